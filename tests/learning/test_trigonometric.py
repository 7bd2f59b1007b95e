import numpy as np
import pytest
from block_checks import (
    check_golden_block,
    check_monte_carlo,
    check_pullback,
    golden_cases,
    random_gaussian,
)

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.trigonometric import sine_cosine_moments, sine_moments


def scaled(moments, pullback, scale):
    scale = np.asarray(scale)
    result = Moments(
        scale * moments.mean,
        moments.covariance * np.outer(scale, scale),
        scale[:, None] * moments.jacobian,
    )
    return result, lambda m, S, J: pullback(
        scale * m, S * np.outer(scale, scale), scale[:, None] * J
    )


def selected(inputs):
    index = inputs["idx"].ravel().astype(int) - 1
    return Gaussian(inputs["m"].ravel(), inputs["S"]), index


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("gSin")))
def test_sine_agrees_with_the_original(case, given, expected):
    state, index = selected(given)
    pick = np.eye(len(state.mean))[index]
    moments, pull = sine_moments(Gaussian(pick @ state.mean, pick @ state.covariance @ pick.T))
    moments = Moments(moments.mean, moments.covariance, moments.jacobian @ pick)

    def pullback(m, S, J):
        m_bar, S_bar = pull(m, S, J @ pick.T)
        return pick.T @ m_bar, pick.T @ S_bar @ pick

    block = scaled(moments, pullback, given["e"].ravel())
    check_golden_block(block[0], block[1], expected)


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("gTrig")))
def test_sine_and_cosine_agree_with_the_original(case, given, expected):
    state, index = selected(given)
    block = sine_cosine_moments(state, index)
    block = scaled(*block, np.repeat(given["e"].ravel(), 2))
    check_golden_block(block[0], block[1], expected)


def test_sine_and_cosine_against_monte_carlo():
    state = random_gaussian(np.random.default_rng(0), 4)
    moments, _ = sine_cosine_moments(state, [2, 0])

    def function(x):
        return np.stack(
            [np.sin(x[:, 2]), np.cos(x[:, 2]), np.sin(x[:, 0]), np.cos(x[:, 0])], axis=1
        )

    check_monte_carlo(moments, state, function)


@pytest.mark.parametrize("spread", [0.05, 0.5, 3.0])
def test_gradient(spread):
    state = random_gaussian(np.random.default_rng(1), 3, spread)
    check_pullback(lambda at: sine_cosine_moments(at, [0, 2]), state)


def test_huge_spread_stays_finite():
    moments, pullback = sine_moments(Gaussian(np.zeros(2), 1e6 * np.ones((2, 2))))
    bars = pullback(np.ones(2), np.ones((2, 2)), np.ones((2, 2)))
    assert np.isfinite(moments.covariance).all()
    assert all(np.isfinite(bar).all() for bar in bars)


def test_no_spread_is_the_sine_itself():
    moments, _ = sine_moments(Gaussian(np.array([0.3, -1.2]), np.zeros((2, 2))))
    np.testing.assert_array_equal(moments.mean, np.sin([0.3, -1.2]))
    np.testing.assert_array_equal(moments.covariance, np.zeros((2, 2)))
