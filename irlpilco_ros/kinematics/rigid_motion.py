"""Poses and motions of rigid bodies as homogeneous matrices (4, 4), positions in [m]."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from irlpilco_ros.learning.numerics.arrays import Array


def pose(position: ArrayLike, roll_pitch_yaw: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Return the pose (4, 4) with these angles about fixed x, y, z (URDF's rpy) [rad].

    Args:
        position: x, y, z [m].
        roll_pitch_yaw: Angles [rad].
    """
    return pose_of(position, Rotation.from_euler("xyz", np.asarray(roll_pitch_yaw)).as_matrix())


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
    return pose_of(position, Rotation.from_quat(np.asarray(quaternion, dtype=float)).as_matrix())


def quaternion_of(matrix: Array) -> Array:
    """Return the quaternion x, y, z, w (4,) of a pose, w not negative."""
    quaternion: Array = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True)
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
    vectors = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec()
    shaped: Array = vectors.reshape((*rotations.shape[:-2], 3))
    return shaped


def part_of(motion: Array, share: float) -> Array:
    """Return the rigid motion (4, 4) that goes a share of the way of another one, 0 to 1."""
    turn = Rotation.from_rotvec(share * rotation_vector(motion[:3, :3]))
    return pose_of(share * motion[:3, 3], turn.as_matrix())


def mean_pose(poses: Array) -> Array:
    """Return the mean (4, 4) of poses (n, 4, 4) that are near to each other."""
    turn = Rotation.from_matrix(poses[:, :3, :3]).mean()
    return pose_of(poses[:, :3, 3].mean(axis=0), turn.as_matrix())
