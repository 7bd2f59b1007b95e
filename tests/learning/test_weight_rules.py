import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import optimize

from irlpilco_ros.learning.weight_rules import (
    WEIGHT_RULES,
    latest,
    max_margin,
    max_margin_spread,
    minimum_norm_point,
    projection,
    uniform,
)

DEVIATIONS = st.tuples(st.integers(1, 6), st.integers(1, 5)).flatmap(
    lambda shape: arrays(float, shape, elements=st.floats(0.0, 100.0).map(lambda x: round(x, 3)))
)


def by_generic_solver(points):
    """max t s.t. w'psi_j >= t, |w| <= 1."""
    k = points.shape[1]
    scale = points.max()
    start = np.append(np.full(k, 0.5 / np.sqrt(k)), 0.0)
    result = optimize.minimize(
        lambda x: -x[-1],
        start,
        constraints=[
            {"type": "ineq", "fun": lambda x: points @ x[:-1] / scale - x[-1]},
            {"type": "ineq", "fun": lambda x: 1.0 - x[:-1] @ x[:-1]},
        ],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return result.x[:-1], scale * result.x[-1]


@pytest.mark.parametrize("seed", range(12))
def test_max_margin_agrees_with_a_generic_solver(seed):
    rng = np.random.default_rng(seed)
    points = rng.exponential(size=(rng.integers(1, 9), rng.integers(2, 8)))
    weights, margin = max_margin(points)
    expected_weights, expected_margin = by_generic_solver(points)
    assert margin == pytest.approx(expected_margin, rel=1e-5)
    np.testing.assert_allclose(weights, expected_weights, atol=1e-3)


@settings(deadline=None)
@given(DEVIATIONS)
def test_max_margin_is_optimal(points):
    """Every trial is at least the margin away, and no mixture is nearer: this is a certificate."""
    weights, margin = max_margin(points)
    scale = max(points.max(), 1e-9)
    assert np.linalg.norm(weights) == pytest.approx(1.0)
    assert (weights >= -1e-9).all()
    assert (points @ weights >= margin - 1e-6 * scale).all()
    assert margin <= np.linalg.norm(points, axis=1).min() + 1e-9 * scale


@settings(deadline=None)
@given(DEVIATIONS)
def test_the_margin_never_increases_with_another_trial(points):
    margins = [max_margin(points[: n + 1])[1] for n in range(len(points))]
    assert (np.diff(margins) <= 1e-6 * max(points.max(), 1e-9)).all()


@settings(deadline=None)
@given(DEVIATIONS)
def test_beside_a_single_demonstration_there_is_no_spread_to_look_beyond(points):
    found, alone = max_margin_spread(points, np.zeros_like(points)), max_margin(points)
    assert found[1] == pytest.approx(alone[1], abs=1e-9 * max(points.max(), 1e-9))
    if alone[1] > 1e-9 * points.max():  # else a mixture of trials is as shown, to rounding
        np.testing.assert_allclose(found[0], alone[0], atol=1e-6)


def test_what_the_demonstrations_do_not_agree_on_tells_no_trial_apart():
    trials, expert = np.array([[4.0, 9.0], [3.0, 16.0]]), np.array([[0.0, 25.0], [0.0, 25.0]])
    weights, margin = max_margin_spread(trials, expert)
    np.testing.assert_allclose(weights, [1.0, 0.0])
    assert margin == pytest.approx(3.0)
    assert max_margin(trials)[0][1] > 0.9, "to that it is the very feature that counts most"


def test_trials_that_are_nowhere_further_off_than_the_demonstrations_have_no_margin():
    weights, margin = max_margin_spread(np.array([[1.0, 2.0]]), np.array([[1.0, 3.0]]))
    np.testing.assert_allclose(weights, np.ones(2) / np.sqrt(2))
    assert margin == 0.0


@pytest.mark.parametrize("seed", range(12))
def test_max_margin_beyond_the_spread_agrees_with_a_generic_solver(seed):
    """max t s.t. w'(psi_j - psi_E) >= t, |w| <= 1, w >= 0."""
    rng = np.random.default_rng(seed)
    points = rng.exponential(size=(rng.integers(1, 9), rng.integers(2, 8)))
    expert = np.tile(0.7 * rng.exponential(size=points.shape[1]), (len(points), 1))
    weights, margin = max_margin_spread(points, expert)
    k, excess = points.shape[1], points - expert
    start = np.append(np.full(k, 0.5 / np.sqrt(k)), -1.0)
    result = optimize.minimize(
        lambda x: -x[-1],
        start,
        constraints=[
            {"type": "ineq", "fun": lambda x: excess @ x[:-1] - x[-1]},
            {"type": "ineq", "fun": lambda x: 1.0 - x[:-1] @ x[:-1]},
        ],
        bounds=[(0.0, None)] * k + [(None, None)],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert margin == pytest.approx(result.x[-1], rel=1e-5, abs=1e-6)
    if margin > 0.0:
        np.testing.assert_allclose(weights, result.x[:-1], atol=1e-3)


@pytest.mark.parametrize("rule", WEIGHT_RULES)
def test_every_rule_gives_unit_weights_and_a_finite_margin(rule):
    rng = np.random.default_rng(0)
    for points in (
        rng.exponential(size=(5, 4)),
        np.zeros((2, 4)),
        np.ones((3, 4)),
        1e-9 * np.ones((1, 4)),
    ):
        weights, margin = WEIGHT_RULES[rule](points, np.zeros_like(points))
        assert np.linalg.norm(weights) == pytest.approx(1.0)
        assert (weights >= 0.0).all()
        assert margin >= 0.0
        assert np.isfinite(margin)


def test_minimum_norm_point_between_two_points():
    np.testing.assert_allclose(
        minimum_norm_point(np.array([[2.0, 0.0], [0.0, 2.0]])), [1.0, 1.0], rtol=1e-6
    )


def test_latest_sees_the_last_trial_alone():
    weights, margin = latest(np.array([[0.0, 1.0], [3.0, 4.0]]))
    np.testing.assert_allclose(weights, [0.6, 0.8])
    assert margin == pytest.approx(5.0)


def test_projection_steps_towards_the_origin_and_no_further_than_the_trial():
    point = projection(np.array([[2.0, 0.0], [0.0, 2.0]]))
    np.testing.assert_allclose(point[0], np.ones(2) / np.sqrt(2))
    assert point[1] == pytest.approx(np.sqrt(2))
    clipped = projection(np.array([[4.0, 0.0], [1.0, 0.0]]))
    assert clipped[1] == pytest.approx(1.0)


def test_uniform_margin_is_the_best_trial():
    weights, margin = uniform(np.array([[1.0, 1.0], [3.0, 4.0]]))
    np.testing.assert_allclose(weights, np.ones(2) / np.sqrt(2))
    assert margin == pytest.approx(np.sqrt(2))
