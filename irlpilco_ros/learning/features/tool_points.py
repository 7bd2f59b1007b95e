"""Where a robot's tools are, as their object sees them: what a motion is for.

Three points of each tool say where it is and how it is turned. How the joints stand is free as far
as the tools leave it, and held by a small price.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features.base import REGISTRY, Features
from irlpilco_ros.learning.features.cubature import CubatureFeatures
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array


class ToolMotion(Protocol):
    """What tells where K tools are, and how they move with the J joints."""

    def poses_and_jacobians(self, positions: Array) -> tuple[Array, Array]:
        """Return poses (K, 4, 4), and velocities and angular velocities by the joints' (K, 6, J).

        Args:
            positions: Of the joints (J,) [rad].
        """


@dataclass(frozen=True)
class ComparedTools:
    """The tools of a robot, and how they are compared.

    Attributes:
        motion: Where they are.
        size: How far from each the other two points are, along its x and y [m]; 0: it is one point.
        posture: What joints that are off count beside the tools [m/rad]; 0: they do not count.
    """

    motion: ToolMotion
    size: float
    posture: float


@dataclass(frozen=True)
class _Points:
    """The points of the tools, and the joints at their price, as a function of the joints.

    Attributes:
        tools: The tools.
        back: What takes points back to where they would be if the object lay where it was shown.
    """

    tools: ComparedTools
    back: Array

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Return features (m, k) at joint positions (m, J), and their Jacobians (m, k, J)."""
        count, joints = points.shape
        both = [self.tools.motion.poses_and_jacobians(positions) for positions in points]
        poses, jacobians = (np.stack(each) for each in zip(*both, strict=True))
        arms = poses[:, :, :3, : 2 if self.tools.size else 0].swapaxes(2, 3) * self.tools.size
        offsets = np.concatenate([np.zeros((*poses.shape[:2], 1, 3)), arms], axis=2)
        turn = self.back[:3, :3]
        places = (poses[:, :, None, :3, 3] + offsets) @ turn.T + self.back[:3, 3]
        # A point that is off the tool by o moves by v + w x o, which is v - [o]x w.
        moves = jacobians[:, :, None, :3] - _crossing(offsets) @ jacobians[:, :, None, 3:]
        slopes = (turn @ moves).reshape(count, -1, joints)
        values, price = places.reshape(count, -1), self.tools.posture
        if not price:
            return values, slopes
        priced = np.broadcast_to(price * np.eye(joints), (count, joints, joints))
        return np.hstack([values, price * points]), np.concatenate([slopes, priced], axis=1)


def _crossing(vectors: Array) -> Array:
    """Return the matrices (..., 3, 3) that multiply by vectors (..., 3) from the left: a x b."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@REGISTRY.register("tools")
class ToolPoints(CubatureFeatures):
    """x, y, z of the tools' points [m], as far as the object has not moved, and the posture.

    Where the object has moved they are carried back with it, so that what is imitated is the same
    everywhere: the demonstration as the object saw it.
    """

    @classmethod
    def of_tools(
        cls, joints: Joints, settings: Any, tools: Callable[[], ComparedTools]
    ) -> Features:
        """Return the tools' points.

        Raises:
            InvalidSettingError: a joint turns without end: its position is no number to compare.
        """
        if joints.continuous:
            raise InvalidSettingError(
                f"features: tools compares postures, but {', '.join(joints.continuous)} turn "
                "without end; set features: joints"
            )
        points, count = _Points(tools(), np.eye(4)), len(joints.names)
        values, _ = points(np.zeros((1, count)))
        return cls(count, points, ("m",) * values.shape[1])

    def where_moved(self, move: Array) -> Self:
        """Return these features for an object that has moved rigidly since it was shown."""
        assert isinstance(self.function, _Points)
        turn = move[:3, :3].T
        back = np.eye(4)
        back[:3, :3], back[:3, 3] = turn, -turn @ move[:3, 3]
        return dataclasses.replace(self, function=dataclasses.replace(self.function, back=back))
