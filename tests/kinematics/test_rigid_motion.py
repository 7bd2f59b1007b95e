"""Homogeneous matrices: round trips, and what URDF's angles mean."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from irlpilco_ros.kinematics.rigid_motion import (
    difference,
    inverse,
    mean_pose,
    part_of,
    pose,
    pose_of_quaternion,
    quaternion_of,
    roll_pitch_yaw_of,
)

ANGLES = (0.0, 0.4, -1.3, np.pi / 2, -np.pi / 2, np.pi, 3.0)


def test_angles_and_quaternions_are_those_of_scipy():
    for angles in itertools.product(ANGLES, repeat=3):
        matrix, theirs = pose((0, 0, 0), angles), Rotation.from_euler("xyz", angles)
        np.testing.assert_allclose(matrix[:3, :3], theirs.as_matrix(), atol=1e-15)
        quaternion = quaternion_of(matrix)
        sign = np.sign(quaternion @ theirs.as_quat())
        np.testing.assert_allclose(quaternion, sign * theirs.as_quat(), atol=1e-15)
        assert quaternion[3] >= 0.0
        again = pose((0, 0, 0), roll_pitch_yaw_of(matrix[:3, :3]))
        np.testing.assert_allclose(again, matrix, atol=1e-15)


def some(count: int, size: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(0)
    return np.stack([pose(*(size * rng.uniform(-1.0, 1.0, (2, 3)))) for _ in range(count)])


def test_roll_pitch_yaw_turn_about_fixed_axes():
    roll, yaw = pose((0, 0, 0), (np.pi / 2, 0, 0)), pose((0, 0, 0), (0, 0, np.pi / 2))
    both = pose((1, 2, 3), (np.pi / 2, 0, np.pi / 2))
    np.testing.assert_allclose(both[:3, :3], (yaw @ roll)[:3, :3], atol=1e-15)
    np.testing.assert_array_equal(both[:3, 3], [1, 2, 3])


@pytest.mark.parametrize("matrix", some(5), ids=range(5))
def test_round_trips(matrix):
    np.testing.assert_allclose(inverse(matrix) @ matrix, np.eye(4), atol=1e-15)
    again = pose_of_quaternion(matrix[:3, 3], quaternion_of(matrix))
    np.testing.assert_allclose(again, matrix, atol=1e-15)
    np.testing.assert_allclose(part_of(matrix, 1.0), matrix, atol=1e-15)
    np.testing.assert_allclose(part_of(matrix, 0.0), np.eye(4), atol=1e-15)


def test_a_difference_is_the_way_and_the_turn_that_are_missing():
    reached, turn = some(3), np.array([0.1, -0.2, 0.3])
    step = part_of(pose((0, 0, 0), (0, 0, 0)), 0.0)
    step[:3, :3] = difference_matrix(turn)
    wanted = reached.copy()
    wanted[:, :3, :3] = step[:3, :3] @ reached[:, :3, :3]
    wanted[:, :3, 3] += [1.0, 2.0, 3.0]
    expected = np.tile([1.0, 2.0, 3.0, *turn], (3, 1))
    np.testing.assert_allclose(difference(wanted, reached), expected, atol=1e-14)


def difference_matrix(turn: np.ndarray) -> np.ndarray:
    """Rodrigues' formula."""
    angle = np.linalg.norm(turn)
    x, y, z = turn / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def test_the_mean_of_noisy_poses_is_near_the_truth():
    truth, rng = pose((0.6, -0.1, 0.0), (0.1, -0.2, 2.0)), np.random.default_rng(1)
    noisy = [truth @ pose(*(0.01 * rng.standard_normal((2, 3)))) for _ in range(400)]
    np.testing.assert_allclose(mean_pose(np.stack(noisy)), truth, atol=0.002)
