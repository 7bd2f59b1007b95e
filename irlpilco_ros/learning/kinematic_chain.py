"""Positions of hands and tools from joint angles: features that a demonstration is about.

The thesis compares joint angles, and asks for end-effector features (6, 7.2). Their moments are
found by cubature, see `CubatureFeatures`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.features import CubatureFeatures
from irlpilco_ros.learning.gaussian import Array


@dataclass(frozen=True)
class KinematicChain:
    """Joints one after the other, each turning about the z axis of its own frame, as in a URDF.

    Attributes:
        joints: Where the angle of each joint is in a point, from the base outwards, J of them.
        translations: Origin of each joint's frame in that of the one before [m], shape (J, 3).
        rotations: Its orientation there at angle 0, shape (J, 3, 3).
        tool: The point whose position is wanted, in the last joint's frame [m], shape (3,).
    """

    joints: tuple[int, ...]
    translations: Array
    rotations: Array
    tool: Array

    def positions(self, points: Array) -> tuple[Array, Array]:
        """Return the tool's positions in the base [m] and their Jacobians [m/rad].

        A joint moves the tool at right angles to its axis and to the arm from it to the tool:
        column j is axis_j x (tool - origin_j).

        Args:
            points: Joint angles [rad], shape (m, n); those of other joints have no influence.

        Returns:
            Positions (m, 3) and Jacobians (m, 3, n).
        """
        origin = np.zeros((len(points), 3))
        frame = np.tile(np.eye(3), (len(points), 1, 1))
        axes, origins = [], []
        for joint, translation, rotation in zip(
            self.joints, self.translations, self.rotations, strict=True
        ):
            origin = origin + frame @ translation
            frame = frame @ rotation
            axes.append(frame[:, :, 2])
            origins.append(origin)
            frame = frame @ _turns(points[:, joint])
        tips = origin + frame @ self.tool
        jacobians = np.zeros((len(points), 3, points.shape[1]))
        for joint, axis, origin in zip(self.joints, axes, origins, strict=True):
            jacobians[:, :, joint] = np.cross(axis, tips - origin)
        return tips, jacobians


def tool_positions(chains: Sequence[KinematicChain], joints: int) -> CubatureFeatures:
    """Return the positions of several tools [m] as features of a state.

    Cubature looks the further away from the mean the more joints there are: with a spread of
    0.2 rad, a hand's covariance is 5 % off with the 7 joints of its own arm, 9 % with 14.

    Args:
        chains: One for each tool, such as a hand; their positions follow each other.
        joints: Number of joint angles at the start of the state.
    """

    def function(points: Array) -> tuple[Array, Array]:
        tips, jacobians = zip(*(chain.positions(points) for chain in chains), strict=True)
        return np.concatenate(tips, axis=1), np.concatenate(jacobians, axis=1)

    return CubatureFeatures(3 * len(chains), joints, function)


def rotation_of(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation (3, 3) of a URDF's `rpy` [rad]: about fixed x, then y, then z."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _turns(angles: Array) -> Array:
    """Return rotations about z, shape (m, 3, 3), for angles (m,)."""
    turns = np.zeros((len(angles), 3, 3))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
    turns[:, 1, 0] = np.sin(angles)
    turns[:, 0, 1] = -turns[:, 1, 0]
    turns[:, 2, 2] = 1.0
    return turns
