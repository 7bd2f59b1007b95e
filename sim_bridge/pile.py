"""The pile that is swept: where it lies, and what a camera tells of that."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.kinematics.rigid_motion import inverse, pose, pose_of, quaternion_of

Array = NDArray[np.float64]

SHOWN = pose((0.645, -0.15, -0.12))
"""Pose of the pile's middle on the table when the sweep is shown, in the base frame [m]."""


def pile_pose(place: Sequence[float]) -> Array:
    """Return the pose (4, 4) of a pile that lies elsewhere.

    Args:
        place: x, y [m] and turn [rad], relative to where it lies when the sweep is shown.
    """
    x, y, turn = place
    return pose(SHOWN[:3, 3] + [x, y, 0.0], (0.0, 0.0, turn))


def lay_debris(
    model: mujoco.MjModel, data: mujoco.MjData, key: int, place: Sequence[float]
) -> None:
    """Lay the debris as it lies in a keyframe, moved with the pile.

    Args:
        model: With debris or without.
        data: Is changed.
        key: Number of the keyframe.
        place: As for `pile_pose`.
    """
    move = pile_pose(place) @ inverse(SHOWN)
    for number in range(model.njnt):
        joint = model.joint(number)
        if not joint.name.startswith("debris_"):
            continue
        begin, speed = int(joint.qposadr[0]), int(joint.dofadr[0])
        lies = move @ pose_of(model.key_qpos[key, begin : begin + 3], np.eye(3))
        data.qpos[begin : begin + 3] = lies[:3, 3]
        data.qpos[begin + 3 : begin + 7] = quaternion_of(lies)[[3, 0, 1, 2]]
        data.qvel[speed : speed + 6] = 0.0


class PileCamera:
    """Sees where the pile lies, with noise."""

    def __init__(self, noise: Sequence[float], seed: int) -> None:
        """Make a camera.

        Args:
            noise: Standard deviations of x, y, z [m], and about each axis [rad].
            seed: Of the noise.
        """
        self._noise = np.repeat(noise, 3)
        self._rng = np.random.default_rng([seed, 0x0B1EC7])

    def look(self, place: Sequence[float]) -> Array:
        """Return the pose (4, 4) that it sees."""
        off = self._noise * self._rng.standard_normal(6)
        seen: Array = pile_pose(place) @ pose(off[:3], off[3:])
        return seen
