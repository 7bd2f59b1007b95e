"""Moment matching of the dynamics model: the original's values, Monte Carlo, differences."""

import dataclasses

import numpy as np
import pytest
from block_checks import (
    check_monte_carlo,
    check_pullback,
    golden_cases,
    random_bars,
    reference_bars,
)
from dynamics_examples import example_input, example_model

from irlpilco_ros.learning.errors import InvalidSettingError, NumericalError
from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.moment_matching import MomentMatching
from irlpilco_ros.learning.moments.pair_blocks import column_strips
from irlpilco_ros.learning.numerics.sharing import output_groups
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel


def check_that_it_is_cut(model):
    """Into groups of outputs, and strips of columns."""
    n, size = model.inputs.shape
    outputs = model.targets.shape[1]
    assert len(output_groups(outputs, outputs * n * n * size)) > 1
    assert len(column_strips(n)) > 1


def original_hyperparameters(given):
    size = given["X"].shape[1]
    hyp = given["hyp"]
    return Hyperparameters(hyp[:size].T.copy(), hyp[size], hyp[size + 1])


def check_original(moments, pullback, given, expected, tolerance):
    """Compare with M, S, V and the dense derivatives of the original."""
    size = given["X"].shape[1]
    signal = np.exp(2.0 * given["hyp"][size]).max()
    for value, name in ((moments.mean[:, None], "M"), (moments.jacobian.T, "V")):
        reference = expected[name]
        scale = np.abs(reference).max()
        np.testing.assert_allclose(value, reference, rtol=0, atol=tolerance * scale)
    np.testing.assert_allclose(
        moments.covariance, expected["S"], rtol=0, atol=max(1e-8, tolerance) * signal
    )
    bars = random_bars(np.random.default_rng(3), moments)
    out = {key.replace("dV", "dC"): value for key, value in expected.items()}
    mean_bar = reference_bars(out, bars, "", "m")
    covariance_bar = reference_bars(out, bars, "", "s").reshape(size, size)
    covariance_bar = 0.5 * (covariance_bar + covariance_bar.T)
    for value, reference in zip(pullback(*bars), (mean_bar, covariance_bar), strict=True):
        scale = np.abs(reference).max()
        np.testing.assert_allclose(value, reference, rtol=0, atol=max(1e-8, tolerance) * scale)


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("gp0")))
def test_exact_agrees_with_the_original(case, given, expected):
    model = DynamicsModel.condition(given["X"], given["Y"], original_hyperparameters(given))
    moments, pullback = model.predict(given["m"][:, 0], given["S"], "exact")
    check_original(
        moments, pullback, given, expected, 1e-6 if case.startswith("gp0_highsnr") else 1e-9
    )


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("gp0")))
def test_first_order_differs_only_between_outputs(case, given, expected):
    model = DynamicsModel.condition(given["X"], given["Y"], original_hyperparameters(given))
    moments, _ = model.predict(given["m"][:, 0], given["S"], "first_order")
    signal = np.exp(2.0 * given["hyp"][given["X"].shape[1]]).max()
    np.testing.assert_allclose(moments.mean, expected["M"][:, 0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        np.diagonal(moments.covariance), np.diagonal(expected["S"]), rtol=0, atol=1e-8 * signal
    )
    cross = expected["V"].T @ given["S"] @ expected["V"]
    np.testing.assert_allclose(
        moments.covariance - np.diag(np.diagonal(moments.covariance)),
        cross - np.diag(np.diagonal(cross)),
        rtol=1e-8,
        atol=1e-8 * signal,
    )


@pytest.mark.parametrize("prior", [False, True])
@pytest.mark.parametrize("approximation", ["linearised", "first_order", "exact"])
@pytest.mark.parametrize("seed", range(3))
def test_gradient(approximation, prior, seed):
    model = example_model(seed, prior=prior)
    at = example_input(seed + 10, 4)
    check_pullback(lambda g: model.predict(g.mean, g.covariance, approximation), at)


@pytest.mark.parametrize("approximation", ["linearised", "first_order", "exact"])
def test_gradient_over_several_groups_and_strips(approximation):
    model = example_model(4, n=260, outputs=8, inputs=6, threads=2)
    check_that_it_is_cut(model)
    at = example_input(5, 6)
    check_pullback(lambda g: model.predict(g.mean, g.covariance, approximation), at)


@pytest.mark.parametrize("approximation", ["linearised", "first_order", "exact"])
def test_without_spread_the_variance_over_several_strips_is_the_posteriors(approximation):
    """s^2 - k(x, X) K^-1 k(X, x) (2.24)."""
    model = example_model(4, n=200, inputs=6)
    assert len(column_strips(200)) > 1
    x, hyperparameters = example_input(5, 6).mean, model.hyperparameters
    moments, _ = model.predict(x, np.zeros((6, 6)), approximation, gradient=False)
    for a, signal in enumerate(hyperparameters.signal_variance):
        lengthscales = np.exp(hyperparameters.log_lengthscales[a])
        gram = squared_exponential(model.inputs, model.inputs, lengthscales, signal)
        gram += hyperparameters.noise_variance[a] * np.eye(len(gram))
        k = squared_exponential(x[None], model.inputs, lengthscales, signal)[0]
        expected = signal - k @ np.linalg.solve(gram, k)
        assert moments.covariance[a, a] == pytest.approx(expected, rel=1e-6)


def test_exact_against_monte_carlo():
    """Sample functions at sampled inputs: mean, variance and covariances of the output."""
    model = example_model(2, n=12, prior=True)
    at = example_input(7, 4, spread=1.0)
    moments, _ = model.predict(at.mean, at.covariance, "exact")
    rng = np.random.default_rng(1)
    posterior, hyperparameters = model.posterior, model.hyperparameters

    def sample(x):
        columns = []
        for a in range(3):
            lengthscales = np.exp(hyperparameters.log_lengthscales[a])
            signal = hyperparameters.signal_variance[a]
            k = squared_exponential(x, model.inputs, lengthscales, signal)
            gram = squared_exponential(model.inputs, model.inputs, lengthscales, signal)
            gram += hyperparameters.noise_variance[a] * np.eye(len(gram))
            variance = signal - np.sum(k * np.linalg.solve(gram, k.T).T, axis=1)
            mean = k @ posterior.weights[a] + x @ model.prior_mean[a]
            columns.append(mean + np.sqrt(variance) * rng.standard_normal(len(x)))
        return np.stack(columns, axis=1)

    check_monte_carlo(moments, at, sample)


def test_approximations_agree_for_small_spreads():
    model = example_model(1)
    at = example_input(3, 4, spread=1e-3)
    exact, _ = model.predict(at.mean, at.covariance, "exact")
    rough, _ = model.predict(at.mean, at.covariance, "first_order")
    np.testing.assert_allclose(exact.mean, rough.mean, rtol=1e-12)
    np.testing.assert_allclose(exact.covariance, rough.covariance, rtol=1e-5, atol=1e-10)


def test_linearised_leaves_out_what_falls_with_the_square_of_the_spread():
    """A tenth of the spread, a hundredth of the difference to moment matching."""
    model = example_model(1)

    def difference(spread):
        at = example_input(3, 4, spread)
        exact, _ = model.predict(at.mean, at.covariance, "exact")
        mine, _ = model.predict(at.mean, at.covariance, "linearised")
        return np.array(
            [np.abs(exact.mean - mine.mean), np.abs(exact.jacobian - mine.jacobian).max(1)]
        )

    np.testing.assert_allclose(100.0 * difference(0.003) / difference(0.03), 1.0, atol=0.05)


def test_linearised_about_points_that_each_output_has_of_its_own():
    model = example_model(2, prior=True)
    shared = model.posterior
    points = np.repeat(shared.points, shared.outputs, axis=0)
    each = MomentMatching(dataclasses.replace(shared, points=points), model.prior_mean)
    at = example_input(7, 4)
    moments, pullback = each.moments(at.mean, at.covariance, "linearised")
    expected, expected_pullback = model.predict(at.mean, at.covariance, "linearised")
    bars = random_bars(np.random.default_rng(0), moments)
    np.testing.assert_allclose(moments.covariance, expected.covariance, rtol=1e-12)
    np.testing.assert_allclose(moments.jacobian, expected.jacobian, rtol=1e-12)
    for mine, theirs in zip(pullback(*bars), expected_pullback(*bars), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-12)


def test_linear_prior_mean_passes_through_exactly():
    """Far from the data the GP says nothing: what is left is the linear mean."""
    model = example_model(3, prior=True)
    at = example_input(3, 4)
    far = Gaussian(at.mean + 1e4, at.covariance)
    moments, _ = model.predict(far.mean, far.covariance)
    prior = model.prior_mean
    np.testing.assert_allclose(moments.mean, prior @ far.mean, rtol=1e-12)
    np.testing.assert_allclose(moments.jacobian, prior, rtol=1e-12, atol=1e-12)
    signal = model.hyperparameters.signal_variance
    expected = prior @ far.covariance @ prior.T + np.diag(signal)
    np.testing.assert_allclose(moments.covariance, expected, rtol=1e-9)


@pytest.mark.parametrize("approximation", ["linearised", "first_order", "exact"])
def test_threads_and_gradient_do_not_change_a_bit(approximation):
    at = example_input(5, 6)
    results = []
    for threads in (1, 2, 3):
        model = example_model(4, n=260, outputs=8, inputs=6, threads=threads)
        check_that_it_is_cut(model)
        moments, pullback = model.predict(at.mean, at.covariance, approximation)
        bars = random_bars(np.random.default_rng(0), moments)
        results.append([moments.mean, moments.covariance, moments.jacobian, *pullback(*bars)])
        value, nothing = model.predict(at.mean, at.covariance, approximation, gradient=False)
        assert nothing is None
        np.testing.assert_allclose(value.mean, moments.mean, rtol=1e-12)
        np.testing.assert_allclose(value.covariance, moments.covariance, rtol=1e-9, atol=1e-12)
    for other in results[1:]:
        for mine, theirs in zip(results[0], other, strict=True):
            np.testing.assert_array_equal(mine, theirs)


def test_refusals_say_what_was_expected():
    model = example_model()
    at = example_input(0, 4)
    with pytest.raises(InvalidSettingError, match="valid: linearised, first_order, exact"):
        model.predict(at.mean, at.covariance, "second_order")
    with pytest.raises(InvalidSettingError, match=r"expected \(4,\) and \(4, 4\)"):
        model.predict(at.mean[:3], at.covariance)
    with pytest.raises(NumericalError, match="not finite"):
        model.predict(at.mean * np.nan, at.covariance)
    with pytest.raises(NumericalError, match="smallest eigenvalue is -50"):
        model.predict(at.mean, -50.0 * np.eye(4))
    with pytest.raises(NumericalError, match="not finite"):
        MomentMatching(model.posterior, model.prior_mean).moments(
            at.mean, at.covariance * np.inf, "exact"
        )
