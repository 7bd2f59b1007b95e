import numpy as np
import pytest
from block_checks import check_monte_carlo, check_pullback, random_gaussian

from irlpilco_ros.learning.features import CubatureFeatures, JointPositions, PositionsAndAngles
from irlpilco_ros.learning.moments.cubature import cubature_moments
from irlpilco_ros.learning.moments.gaussian import Gaussian


def planar_arm(points):
    """Hand position [m] of a planar arm of three links, and its Jacobian."""
    lengths = np.array([0.4, 0.35, 0.2])
    angles = np.cumsum(points, axis=1)
    x, y = lengths * np.cos(angles), lengths * np.sin(angles)
    values = np.stack([x.sum(axis=1), y.sum(axis=1)], axis=1)
    tails = [np.cumsum(part[:, ::-1], axis=1)[:, ::-1] for part in (-y, x)]
    return values, np.stack(tails, axis=1)


FEATURES = [
    JointPositions(3),
    PositionsAndAngles((2,), (1,)),
    PositionsAndAngles((0, 3), (2, 1)),
    CubatureFeatures(3, planar_arm, ("m", "m")),
]


@pytest.mark.parametrize("features", FEATURES)
def test_gradient(features):
    state = random_gaussian(np.random.default_rng(0), 4)
    check_pullback(features.moments, state, jacobian=False)


@pytest.mark.parametrize("features", FEATURES[:3])
def test_moments_against_monte_carlo(features):
    state = random_gaussian(np.random.default_rng(1), 4)
    moments, _ = features.moments(state)
    assert moments.mean.shape == (features.size,)
    check_monte_carlo(moments, state, features.of)


def test_hand_positions_by_cubature_are_within_millimetres():
    state = Gaussian(np.array([0.3, 0.8, -0.4, 0.0]), 0.1**2 * np.eye(4))
    features = FEATURES[3]
    moments, _ = features.moments(state)
    x = np.random.default_rng(2).multivariate_normal(state.mean, state.covariance, 200_000)
    hands = features.of(x)
    assert np.abs(hands.mean(axis=0) - moments.mean).max() < 1e-3
    np.testing.assert_allclose(
        moments.covariance, np.cov(hands.T), atol=0.05 * float(np.var(hands))
    )
    assert moments.jacobian.shape == (2, 4)


def test_cubature_is_exact_for_a_linear_function():
    state = random_gaussian(np.random.default_rng(3), 3)
    A = np.random.default_rng(4).standard_normal((2, 3))
    moments, _ = cubature_moments(lambda p: (p @ A.T, np.tile(A, (len(p), 1, 1))), state)
    np.testing.assert_allclose(moments.mean, A @ state.mean, rtol=1e-9)
    np.testing.assert_allclose(moments.covariance, A @ state.covariance @ A.T, rtol=1e-9)


def test_cubature_takes_a_certain_state():
    moments, _ = FEATURES[3].moments(Gaussian(np.array([0.3, 0.8, -0.4, 0.0]), np.zeros((4, 4))))
    np.testing.assert_allclose(moments.mean, planar_arm(np.array([[0.3, 0.8, -0.4]]))[0][0])


@pytest.mark.parametrize("features", FEATURES)
def test_of_keeps_leading_dimensions(features):
    states = np.random.default_rng(5).standard_normal((2, 5, 4))
    values = features.of(states)
    assert values.shape == (2, 5, features.size)
    np.testing.assert_allclose(values[1, 3], features.of(states[1, 3]))
