"""The fast moment matching against its specification, to 1e-10.

What both round differently grows with the condition of K = k(X, X) + noise, which is at most
1 + n s^2 / noise^2. With a signal of at most ten times the noise and 150 points that is 15000: one
rounding of 1e-16 stays below 1e-11. Beyond that 1e-10 is nothing that double precision can promise
(the original's values with a ratio of 1000 are compared at 1e-6, see test_moment_matching.py).
"""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.gp.posterior import condition
from irlpilco_ros.learning.gp.sparse import condition_sparse
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.moment_matching import MomentMatching
from irlpilco_ros.learning.moments.pair_blocks import column_strips
from irlpilco_ros.learning.moments.reference import reference_moments

APPROXIMATIONS = ["first_order", "exact"]


def random_posterior(rng, n, outputs, inputs, signal_to_noise, input_scale, output_scale, sparse):
    """Return a posterior, and by what each output and each input is measured."""
    x = input_scale * rng.standard_normal((n, inputs))
    y = output_scale * (np.sin(x / input_scale @ rng.standard_normal((inputs, outputs))))
    lengthscales = input_scale * rng.uniform(0.5, 4.0, (outputs, inputs))
    signal = output_scale * rng.uniform(0.5, 2.0, outputs)
    hyperparameters = Hyperparameters(
        np.log(lengthscales), np.log(signal), np.log(signal / signal_to_noise)
    )
    if sparse:
        count = max(1, n // 2)
        points = np.stack([x[rng.permutation(n)[:count]] for _ in range(outputs)])
        ridge = signal_to_noise**-2  # for the same reason as the noise
        posterior = condition_sparse(x, y, hyperparameters, points, ridge=ridge)
    else:
        posterior = condition(x, y, hyperparameters)
    return posterior, signal, np.full(inputs, input_scale)


def check(posterior, prior, at, approximation, output_units, input_units):
    """Compare in units of the outputs' signal and the inputs' spread."""
    fast, _ = MomentMatching(posterior, prior).moments(at.mean, at.covariance, approximation)
    reference = reference_moments(posterior, prior, at, approximation)
    for name, units in (
        ("mean", output_units),
        ("covariance", np.outer(output_units, output_units)),
        ("jacobian", np.outer(output_units, 1.0 / input_units)),
    ):
        mine, expected = getattr(fast, name) / units, getattr(reference, name) / units
        tolerance = 1e-10 * max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(mine, expected, rtol=0, atol=tolerance, err_msg=name)


@settings(max_examples=120, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(1, 150),
    outputs=st.integers(1, 4),
    inputs=st.integers(1, 6),
    signal_to_noise=st.floats(0.5, 10.0),
    input_scale=st.sampled_from([1e-3, 1.0, 1e3]),
    output_scale=st.sampled_from([1e-4, 1.0, 1e4]),
    spread=st.floats(0.0, 3.0),
    rank=st.integers(0, 6),
    sparse=st.booleans(),
    with_prior=st.booleans(),
    approximation=st.sampled_from(APPROXIMATIONS),
)
@example(0, 150, 4, 6, 10.0, 1.0, 1.0, 1.0, 6, False, True, "exact")
@example(0, 150, 4, 6, 10.0, 1.0, 1.0, 1.0, 6, False, True, "first_order")
@example(0, 150, 4, 6, 10.0, 1.0, 1.0, 0.1, 3, True, True, "exact")
@example(0, 150, 4, 6, 10.0, 1.0, 1.0, 0.1, 3, True, True, "first_order")
def test_the_fast_path_computes_what_is_specified(
    seed,
    n,
    outputs,
    inputs,
    signal_to_noise,
    input_scale,
    output_scale,
    spread,
    rank,
    sparse,
    with_prior,
    approximation,
):
    rng = np.random.default_rng(seed)
    posterior, output_units, input_units = random_posterior(
        rng, n, outputs, inputs, signal_to_noise, input_scale, output_scale, sparse
    )
    unit_prior = 0.5 * with_prior * rng.standard_normal((outputs, inputs))
    root = spread * input_scale * rng.standard_normal((inputs, rank)) / np.sqrt(inputs)
    at = Gaussian(input_scale * rng.standard_normal(inputs), root @ root.T)
    prior = unit_prior * np.outer(output_units, 1.0 / input_units)
    check(posterior, prior, at, approximation, output_units, input_units)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_at_the_size_of_a_robot(approximation):
    """Several groups of outputs, several strips of columns, several blocks of pairs."""
    rng = np.random.default_rng(0)
    posterior, output_units, input_units = random_posterior(rng, 200, 9, 12, 5.0, 1.0, 1.0, False)
    assert len(column_strips(200)) > 1
    assert len(MomentMatching(posterior, np.zeros((9, 12)))._groups) > 1
    root = 0.3 * rng.standard_normal((12, 12))
    at = Gaussian(0.3 * rng.standard_normal(12), root @ root.T)
    check(posterior, np.zeros((9, 12)), at, approximation, output_units, input_units)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(1, 150),
    signal_to_noise=st.floats(0.5, 10.0),
    output_scale=st.sampled_from([1e-4, 1.0, 1e4]),
)
def test_a_posterior_keeps_the_inverse_and_the_weights(seed, n, signal_to_noise, output_scale):
    """K^-1 and beta = K^-1 y can be read off (2.22)."""
    rng = np.random.default_rng(seed)
    x, y = rng.standard_normal((n, 3)), output_scale * rng.standard_normal((n, 2))
    lengthscales = rng.uniform(0.5, 4.0, (2, 3))
    hyperparameters = Hyperparameters(
        np.log(lengthscales),
        np.full(2, np.log(output_scale)),
        np.full(2, np.log(output_scale / signal_to_noise)),
    )
    posterior = condition(x, y, hyperparameters)
    for a, (signal, noise) in enumerate(
        zip(hyperparameters.signal_variance, hyperparameters.noise_variance, strict=True)
    ):
        gram = squared_exponential(x, x, lengthscales[a], signal) + noise * np.eye(n)
        np.testing.assert_allclose(gram @ posterior.inverse[a], np.eye(n), atol=1e-10)
        expected = gram @ posterior.weights[a]
        np.testing.assert_allclose(expected, y[:, a], rtol=0, atol=1e-10 * output_scale)
