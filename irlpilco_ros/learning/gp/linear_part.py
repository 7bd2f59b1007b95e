"""A linear part of the dynamics whose coefficients are identified from the trials.

f(x) = A x + z(x)'theta + g(x) with theta ~ N(0, b^2 I): a linear kernel b^2 z z' beside the squared
exponential, whose scale b the evidence finds with everything else. Given g's kernel matrix with
noise K, the coefficients' posterior is N(C Z'K^-1 y, C) with C = (I / b^2 + Z'K^-1 Z)^-1; its mean
joins the prior mean (which is exact for predicted means), and what is not known of the
coefficients widens predictions (Rasmussen & Williams 2006, section 2.7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.gp.repeated_part import RepeatedPart
from irlpilco_ros.learning.gp.scaled_part import ScaledPart
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import jittered_cholesky, triangular_inverse
from irlpilco_ros.learning.numerics.sharing import for_each_output

EXPECTED_LOG_SCALE = math.log(0.3)
"""log b before any data: a robot's gains are right to about a third."""

_BOUNDS = (math.log(1e-3), math.log(10.0))


@dataclass(frozen=True)
class LinearPart:
    """Of which inputs each output has a linear part.

    Attributes:
        columns: Their K indices, shape (E, K).
        scales: What a coefficient of 1 amounts to, in units of the output by that of the input,
            shape (E, K).
    """

    columns: NDArray[np.intp]
    scales: Array

    def of(self, inputs: Array, a: int) -> Array:
        """Return Z of output a, shape (n, K), for inputs (n, P)."""
        z: Array = inputs[:, self.columns[a]] * self.scales[a]
        return z

    def scaled(self, inputs: Array, a: int) -> ScaledPart:
        """Return the part of output a's kernel for inputs (n, P)."""
        z = self.of(inputs, a)
        return ScaledPart(z @ z.T, EXPECTED_LOG_SCALE, _BOUNDS)

    @staticmethod
    def none(outputs: int) -> LinearPart:
        """Return the part without any coefficient."""
        return LinearPart(np.zeros((outputs, 0), dtype=np.intp), np.zeros((outputs, 0)))


@dataclass(frozen=True)
class Identified:
    """What the data say about the coefficients, and about what repeats.

    Attributes:
        mean: Of the coefficients, as a matrix like a prior mean, shape (E, P).
        columns: Of which inputs there are coefficients, shape (E, K).
        covariance: Of the coefficients, shape (E, K, K).
        repeated: Mean of what repeats at each step of a trial, shape (H, E); H is 0 without.
        repeated_variance: How uncertain that is, shape (H, E).
    """

    mean: Array
    columns: NDArray[np.intp]
    covariance: Array
    repeated: Array
    repeated_variance: Array


def identify(
    linear: LinearPart | None,
    repeated: RepeatedPart | None,
    inputs: Array,
    targets: Array,
    rows: NDArray[np.intp],
    hyperparameters: Hyperparameters,
    threads: int = 1,
) -> Identified:
    """Return the posterior of the coefficients, and of what repeats, together.

    Args:
        linear: Of what there are coefficients; None for none.
        repeated: To which step each point belongs; None if nothing repeats.
        inputs: X, of shape (n, P).
        targets: y, of shape (n, E).
        rows: Which of the points to learn from, shape (m,).
        hyperparameters: Of E outputs and P inputs, with `log_linear` and `log_repeated` as needed.
        threads: How many threads may work.

    Raises:
        NumericalError: if a kernel matrix is not positive definite whatever the jitter.
    """
    outputs, n = targets.shape[1], len(rows)
    part = linear or LinearPart.none(outputs)
    steps = np.empty((n, 0)) if repeated is None else repeated.of(rows)
    inputs, targets = inputs[rows], targets[rows]
    deviations = _prior_deviations(hyperparameters, part.columns.shape[1], steps.shape[1])
    size = part.columns.shape[1]
    mean = np.zeros((outputs, inputs.shape[1]))
    covariance = np.empty((outputs, size, size))
    offsets, variances = np.empty((2, steps.shape[1], outputs))

    def one_output(a: int) -> None:
        signal = float(hyperparameters.signal_variance[a])
        kernel = squared_exponential(
            inputs, inputs, np.exp(hyperparameters.log_lengthscales[a]), signal
        )
        kernel[range(n), range(n)] += hyperparameters.noise_variance[a]
        factor, _ = jittered_cholesky(kernel, signal)
        inverse_factor = triangular_inverse(factor)
        whitened = inverse_factor @ np.hstack([part.of(inputs, a), steps])
        posterior = np.linalg.inv(np.diag(deviations[a] ** -2) + whitened.T @ whitened)
        found = posterior @ (whitened.T @ (inverse_factor @ targets[:, a]))
        mean[a, part.columns[a]] = part.scales[a] * found[:size]
        covariance[a] = np.outer(part.scales[a], part.scales[a]) * posterior[:size, :size]
        offsets[:, a], variances[:, a] = found[size:], np.diagonal(posterior)[size:]

    for_each_output(one_output, outputs, n, threads)
    return Identified(mean, part.columns, covariance, offsets, variances)


def _prior_deviations(hyperparameters: Hyperparameters, linear: int, repeated: int) -> Array:
    """Return the standard deviations before any data, shape (E, K + H)."""
    parts = []
    for size, scale in (
        (linear, hyperparameters.log_linear),
        (repeated, hyperparameters.log_repeated),
    ):
        if size:
            assert scale is not None
            parts.append(np.repeat(np.exp(scale)[:, None], size, axis=1))
    return np.hstack(parts)
