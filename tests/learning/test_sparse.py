"""The sparse posterior: the original's values, its exact limit, and what it costs."""

import time

import numpy as np
import pytest
from block_checks import check_pullback, golden_cases
from dynamics_examples import example_data, example_hyperparameters, example_input, example_model
from test_moment_matching import check_original, original_hyperparameters

from irlpilco_ros.learning.gp.posterior import condition
from irlpilco_ros.learning.gp.sparse import condition_sparse, spread_points
from irlpilco_ros.learning.moments.moment_matching import MomentMatching
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("gp1")))
def test_agrees_with_the_original(case, given, expected):
    hyperparameters = original_hyperparameters(given)
    posterior = condition_sparse(
        given["X"],
        given["Y"],
        hyperparameters,
        given["induce"].transpose(2, 0, 1),
        ridge=1e-6 / hyperparameters.signal_variance,
    )
    prior = np.zeros(hyperparameters.log_lengthscales.shape)
    matching = MomentMatching(posterior, prior)
    moments, pullback = matching.moments(given["m"][:, 0], given["S"], "exact")
    check_original(moments, pullback, given, expected, 1e-9)


def test_all_points_inducing_is_the_exact_posterior():
    rng = np.random.default_rng(0)
    x, y = example_data(rng, 25, 2, 3)
    hyperparameters = example_hyperparameters(rng, 2, 3)
    exact = condition(x, y, hyperparameters)
    sparse = condition_sparse(x, y, hyperparameters, x[None], ridge=1e-12)
    np.testing.assert_allclose(sparse.weights, exact.weights, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(sparse.inverse, exact.inverse, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("approximation", ["first_order", "exact"])
def test_gradient(approximation):
    model = example_model(1, n=60, max_exact_points=20)
    assert model.posterior.weights.shape == (3, 20)
    assert model.notes == ("sparse model: 20 inducing points for 60 points",)
    at = example_input(2, 4)
    check_pullback(lambda g: model.predict(g.mean, g.covariance, approximation), at)


def test_predicts_nearly_what_the_exact_model_predicts():
    rng = np.random.default_rng(3)
    x, y = example_data(rng, 400, 2, 2)
    exact = DynamicsModel.train(x, y, max_evaluations=60, max_exact_points=400)
    sparse = DynamicsModel.train(x, y, max_evaluations=60, max_exact_points=80)
    for seed in range(5):
        at = example_input(seed, 2, spread=0.3)
        truth, _ = exact.predict(at.mean, at.covariance)
        found, _ = sparse.predict(at.mean, at.covariance)
        deviation = np.sqrt(np.diagonal(truth.covariance))
        assert (np.abs(found.mean - truth.mean) < 0.15 * deviation + 0.01).all()


def test_cost_stops_growing():
    def seconds(n):
        model = example_model(0, n=n, outputs=4, inputs=6, max_exact_points=60)
        at = example_input(1, 6)
        best = np.inf
        for _ in range(5):
            start = time.thread_time()
            model.predict(at.mean, at.covariance)
            best = min(best, time.thread_time() - start)
        return best

    assert seconds(2000) < 3.0 * seconds(61)


def test_spread_points_cover_and_never_repeat():
    rng = np.random.default_rng(0)
    inputs = np.repeat(rng.standard_normal((7, 3)), 5, axis=0)
    chosen = spread_points(inputs, 20)
    assert len(chosen) == 7
    assert len(np.unique(inputs[chosen], axis=0)) == 7
    corners = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 1.0], [5.0, 0.5], [5.1, 0.5], [10.0, 1.0]])
    assert set(spread_points(corners, 5)) >= {0, 1, 2, 5}
