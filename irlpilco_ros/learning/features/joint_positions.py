"""Joint positions (thesis section 6): what a demonstration is compared by unless told otherwise."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.features.base import REGISTRY, Features, select_moments
from irlpilco_ros.learning.features.positions_and_angles import PositionsAndAngles
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.moments.cubature import MeanPullback
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.registry import NoSettings


@REGISTRY.register("joints")
@dataclass(frozen=True)
class JointPositions(Features):
    """The first J entries of the state.

    Attributes:
        joints: Number of joints J.
    """

    joints: int

    @classmethod
    def of_robot(cls, joints: Joints, settings: NoSettings = NoSettings()) -> Features:  # noqa: B008
        """Return all positions, or sine and cosine of those joints that turn without end."""
        if not joints.continuous:
            return cls(len(joints.names))
        angles = joints.layout.angles
        positions = tuple(i for i in range(len(joints.names)) if i not in angles)
        return PositionsAndAngles(positions, angles)

    @property
    def units(self) -> tuple[str, ...]:
        """[rad] each; [m] for a joint that slides."""
        return ("rad",) * self.joints

    def of(self, states: Array) -> Array:
        """Return the joint positions (..., J) of states (..., D)."""
        return states[..., : self.joints]

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the moments of the joint positions, of a state or of a stack of them."""
        return select_moments(state, self.joints)

    def moments_along(self, states: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the moments of all steps at once."""
        return self.moments(states)
