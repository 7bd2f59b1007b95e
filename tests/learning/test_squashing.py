import numpy as np
import pytest
from block_checks import (
    check_golden_block,
    check_monte_carlo,
    check_pullback,
    golden_cases,
    random_gaussian,
)
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.squashing import (
    squash,
    squashed_moments,
    squashing_slope,
    unsquash,
)

LIMIT = np.array([1.5, 0.3, 4.0])


def identity_block(limit):
    def block(at):
        size = len(at.mean)
        moments, pull = squashed_moments(Moments(at.mean, at.covariance, np.eye(size)), limit)
        return moments, lambda *bars: pull(*bars)[:2]

    return block


@pytest.mark.parametrize(("case", "inputs", "expected"), list(golden_cases("gSat")))
def test_agrees_with_the_original(case, inputs, expected):
    pick = np.eye(len(inputs["m"]))[inputs["idx"].ravel().astype(int) - 1]
    m, S = inputs["m"].ravel(), inputs["S"]
    moments, pull = squashed_moments(
        Moments(pick @ m, pick @ S @ pick.T, pick), inputs["e"].ravel()
    )

    def pullback(*bars):
        m_bar, S_bar, _ = pull(*bars)
        return pick.T @ m_bar, pick.T @ S_bar @ pick

    check_golden_block(moments, pullback, expected)


def test_against_monte_carlo():
    state = random_gaussian(np.random.default_rng(0), 3)
    check_monte_carlo(identity_block(LIMIT)(state)[0], state, lambda x: squash(x, LIMIT))


def test_gradient():
    check_pullback(identity_block(LIMIT), random_gaussian(np.random.default_rng(1), 3))


def test_gradient_by_the_raw_jacobian():
    rng = np.random.default_rng(2)
    at, J, J_bar = random_gaussian(rng, 3), rng.standard_normal((3, 5)), rng.standard_normal((3, 5))
    _, pull = squashed_moments(Moments(at.mean, at.covariance, J), LIMIT)
    found = pull(np.zeros(3), np.zeros((3, 3)), J_bar)[2]
    slope = identity_block(LIMIT)(at)[0].jacobian
    np.testing.assert_allclose(found, slope @ J_bar, rtol=1e-12)


def test_slope_is_the_expected_jacobian():
    at = random_gaussian(np.random.default_rng(3), 3)
    expected = np.diagonal(identity_block(LIMIT)(at)[0].jacobian)
    np.testing.assert_allclose(
        squashing_slope(at.mean, np.diagonal(at.covariance), LIMIT), expected
    )


@given(st.floats(-1e6, 1e6))
def test_never_beyond_the_limit(value):
    assert abs(squash(np.array([value]), np.array([2.0]))[0]) <= 2.0 * (1 + 1e-12)


@given(st.floats(-0.94, 0.94))
def test_unsquash_inverts(ratio):
    value = unsquash(np.array([ratio * 3.0]), np.array([3.0]))
    assert squash(value, np.array([3.0]))[0] == pytest.approx(ratio * 3.0, abs=1e-5)


def test_no_spread_is_the_squashing_itself():
    at = Gaussian(np.array([0.4, -2.0, 0.0]), np.zeros((3, 3)))
    np.testing.assert_allclose(
        identity_block(LIMIT)(at)[0].mean, squash(at.mean, LIMIT), rtol=1e-15
    )
