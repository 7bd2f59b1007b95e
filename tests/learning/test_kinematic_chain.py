"""Hands of Baxter: positions as its URDF has them, Jacobians, and moments by cubature."""

import json

import numpy as np
import pytest
from block_checks import GOLDEN, check_pullback

from irlpilco_ros.learning.gaussian import Gaussian
from irlpilco_ros.learning.kinematic_chain import KinematicChain, rotation_of, tool_positions

QUARTER = 0.5 * np.pi
MOUNT = {"left": (0.219645, 0.7854), "right": (-0.219645, -0.7854)}
LINKS = (
    ((0.055695, 0.0, 0.011038), (0.0, 0.0, 0.0)),
    ((0.069, 0.0, 0.27035), (-QUARTER, 0.0, 0.0)),
    ((0.102, 0.0, 0.0), (QUARTER, 0.0, QUARTER)),
    ((0.069, 0.0, 0.26242), (-QUARTER, -QUARTER, 0.0)),
    ((0.10359, 0.0, 0.0), (QUARTER, 0.0, QUARTER)),
    ((0.01, 0.0, 0.2707), (-QUARTER, -QUARTER, 0.0)),
    ((0.115975, 0.0, 0.0), (QUARTER, 0.0, QUARTER)),
)


def arm(side):
    """Return the chain from the base to a hand; the mount is a part of the first joint."""
    y, yaw = MOUNT[side]
    mount = rotation_of(0.0, 0.0, yaw)
    translations = np.array([xyz for xyz, _ in LINKS])
    rotations = np.stack([rotation_of(*rpy) for _, rpy in LINKS])
    translations[0] = np.array([0.024645, y, 0.118588]) + mount @ translations[0]
    rotations[0] = mount @ rotations[0]
    first = 0 if side == "left" else 7
    hand = np.array([0.0, 0.0, 0.11355])
    return KinematicChain(tuple(range(first, first + 7)), translations, rotations, hand)


HANDS = tool_positions([arm("left"), arm("right")], 14)


def test_hands_are_where_the_robot_has_them():
    cases = json.loads((GOLDEN / "baxter" / "forward_kinematics.json").read_text())["cases"]
    positions = HANDS.of(np.array([case["q"] for case in cases]))
    for found, case in zip(positions, cases, strict=True):
        frames = case["frames"]
        expected = [*frames["left_hand"]["pos"], *frames["right_hand"]["pos"]]
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_jacobians_agree_with_differences():
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 14))
    _, jacobians = HANDS.function(points)
    for joint, change in enumerate(1e-6 * np.eye(14)):
        found = (HANDS.of(points + change) - HANDS.of(points - change)) / 2e-6
        np.testing.assert_allclose(jacobians[:, :, joint], found, atol=1e-8)


@pytest.mark.parametrize("spread", [0.02, 0.2])
def test_gradient_of_the_moments(spread):
    rng = np.random.default_rng(1)
    root = spread * rng.standard_normal((28, 28)) / np.sqrt(28)
    state = Gaussian(rng.uniform(-0.5, 0.5, 28), root @ root.T + 1e-2 * spread**2 * np.eye(28))
    check_pullback(HANDS.moments, state, jacobian=False)


def test_cubature_is_far_better_than_linearisation_for_wide_joints():
    """At 0.2 rad a linearised hand is centimetres off; cubature within a millimetre or so."""
    hand = tool_positions([arm("left")], 7)
    state = Gaussian(np.full(14, 0.3), 0.2**2 * np.eye(14))
    moments, _ = hand.moments(state)
    hands = hand.of(np.random.default_rng(2).normal(0.3, 0.2, (100_000, 7)))
    linearised = hand.of(state.mean[None])[0]
    error = np.abs(moments.mean - hands.mean(axis=0)).max()
    assert error < 1.5e-3
    assert error < 0.1 * np.abs(linearised - hands.mean(axis=0)).max()
    assert np.abs(moments.covariance - np.cov(hands.T)).max() < 0.05 * hands.var(axis=0).max()
