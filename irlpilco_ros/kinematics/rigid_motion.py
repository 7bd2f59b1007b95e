"""Poses and motions of rigid bodies as homogeneous matrices (4, 4), positions in [m]."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from irlpilco_ros.learning.numerics.arrays import Array

_UPRIGHT = 1e-9
"""Cosine of the pitch below which it is a right angle."""


def pose(position: ArrayLike, roll_pitch_yaw: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Return the pose (4, 4) with these angles about fixed x, y, z (URDF's rpy) [rad].

    Args:
        position: x, y, z [m].
        roll_pitch_yaw: Angles [rad].
    """
    cosines, sines = np.cos(roll_pitch_yaw), np.sin(roll_pitch_yaw)
    roll, pitch, yaw = np.eye(3), np.eye(3), np.eye(3)
    for turn, (i, j), c, s in zip(
        (roll, pitch, yaw), ((1, 2), (2, 0), (0, 1)), cosines, sines, strict=True
    ):
        turn[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return pose_of(position, yaw @ pitch @ roll)


def roll_pitch_yaw_of(rotation: Array) -> Array:
    """Return the angles (3,) [rad] about fixed x, y, z that make a rotation matrix (3, 3).

    Where pitch is a right angle, roll and yaw turn about the same axis, and yaw is 0.
    """
    level = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = np.arctan2(-rotation[2, 0], level)
    if level < _UPRIGHT:
        return np.array([np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    return np.array([roll, pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def pose_of(position: ArrayLike, rotation: ArrayLike) -> Array:
    """Return the pose (4, 4) with a position (3,) [m] and a rotation matrix (3, 3)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def pose_of_quaternion(position: ArrayLike, quaternion: ArrayLike) -> Array:
    """Return the pose (4, 4) with a position (3,) [m] and a unit quaternion x, y, z, w.

    Raises:
        ValueError: the quaternion is zero.
    """
    turn = _rotation().from_quat(np.asarray(quaternion, dtype=float))
    return pose_of(position, turn.as_matrix())


def quaternion_of(matrix: Array) -> Array:
    """Return the quaternion x, y, z, w (4,) of a pose, w not negative."""
    # Shepperd, "Quaternion from rotation matrix" (1978): 4 q q', of which the row of the largest
    # element is the most exact.
    (a, b, c), (d, e, f), (g, h, i) = matrix[:3, :3]
    products = np.array(
        [
            [1.0 + a - e - i, b + d, c + g, h - f],
            [b + d, 1.0 - a + e - i, f + h, c - g],
            [c + g, f + h, 1.0 - a - e + i, d - b],
            [h - f, c - g, d - b, 1.0 + a + e + i],
        ]
    )
    row = products[int(np.diag(products).argmax())]
    quaternion: Array = np.copysign(1.0, row[3]) * row / np.linalg.norm(row)
    return quaternion


def inverse(matrix: Array) -> Array:
    """Return the inverse of a rigid motion (4, 4)."""
    rotation, position = matrix[:3, :3], matrix[:3, 3]
    return pose_of(-rotation.T @ position, rotation.T)


def difference(wanted: Array, reached: Array) -> Array:
    """Return what is missing to the wanted poses (..., 6): way [m] and rotation vector [rad].

    Both are in the frame that the poses are in.

    Args:
        wanted: Shape (..., 4, 4).
        reached: Shape (..., 4, 4).
    """
    way = wanted[..., :3, 3] - reached[..., :3, 3]
    turn = wanted[..., :3, :3] @ np.swapaxes(reached[..., :3, :3], -1, -2)
    return np.concatenate([way, rotation_vector(turn)], axis=-1)


def rotation_vector(rotations: Array) -> Array:
    """Return axis times angle [rad] of rotation matrices (..., 3, 3), shape (..., 3)."""
    vectors = _rotation().from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec()
    shaped: Array = vectors.reshape((*rotations.shape[:-2], 3))
    return shaped


def part_of(motion: Array, share: float) -> Array:
    """Return the rigid motion (4, 4) that goes a share of the way of another one, 0 to 1."""
    turn = _rotation().from_rotvec(share * rotation_vector(motion[:3, :3]))
    return pose_of(share * motion[:3, 3], turn.as_matrix())


def mean_pose(poses: Array) -> Array:
    """Return the mean (4, 4) of poses (n, 4, 4) that are near to each other."""
    turn = _rotation().from_matrix(poses[:, :3, :3]).mean()
    return pose_of(poses[:, :3, 3].mean(axis=0), turn.as_matrix())


def _rotation() -> Any:
    from scipy.spatial.transform import Rotation  # late: it takes as long as all else here

    return Rotation
