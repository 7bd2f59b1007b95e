"""Joint positions and velocities: what a motion is compared by between its samples, too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features.base import REGISTRY, Features
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.moments.cubature import MeanPullback
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting


@REGISTRY.register("motion")
@dataclass(frozen=True)
class JointMotion(Features):
    """Positions q and velocities times a time constant, tau q_dot.

    Two motions with the same positions at the ticks differ between them by their velocities: to
    match these as well keeps the whole path near the one that was shown.

    Attributes:
        joints: Number of joints J.
        time: tau [s].
    """

    @dataclass(frozen=True)
    class Settings:
        """What velocities count."""

        time: float = setting(
            0.17,
            "Time by which velocities are multiplied to be compared with positions: more follows "
            "the demonstrated velocities more closely, and the positions less.",
            unit="s",
            minimum=0.0,
            maximum=100.0,
        )

        def __post_init__(self) -> None:
            check(self)

    joints: int
    time: float

    @classmethod
    def of_robot(cls, joints: Joints, settings: Settings) -> Features:
        """Return positions and velocities of all joints.

        Raises:
            InvalidSettingError: a joint turns without end: its position is no number to compare.
        """
        if joints.continuous:
            raise InvalidSettingError(
                f"features: motion compares positions, but {', '.join(joints.continuous)} turn "
                "without end; set features: joints"
            )
        return cls(len(joints.names), settings.time)

    @property
    def units(self) -> tuple[str, ...]:
        """[rad] each; [m] for a joint that slides."""
        return ("rad",) * (2 * self.joints)

    def of(self, states: Array) -> Array:
        """Return [q, tau q_dot] (..., 2J) of states (..., D)."""
        return states[..., : 2 * self.joints] * self._factors

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the moments of positions and scaled velocities."""
        factors, whole = self._factors, len(state.mean)
        size = len(factors)
        both = np.outer(factors, factors)

        def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
            m_bar, S_bar = np.zeros(whole), np.zeros((whole, whole))
            m_bar[:size] = factors * mean_bar
            S_bar[:size, :size] = both * covariance_bar
            return m_bar, S_bar

        moments = Moments(
            factors * state.mean[:size],
            both * state.covariance[:size, :size],
            np.eye(size, whole) * factors[:, None],
        )
        return moments, pullback

    @property
    def _factors(self) -> Array:
        return np.repeat([1.0, self.time], self.joints)
