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
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import jittered_cholesky, triangular_inverse
from irlpilco_ros.learning.numerics.sharing import for_each_output

EXPECTED_LOG_SCALE = math.log(0.3)
"""log b before any data: a robot's gains are right to about a third."""

_SPREAD = 1.0


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


def scale_penalty(log_scale: float) -> tuple[float, float]:
    """Return -log p(log b) up to a constant, log b ~ N(log 0.3, 1), and its derivative."""
    ratio = (log_scale - EXPECTED_LOG_SCALE) / _SPREAD
    return 0.5 * ratio**2, ratio / _SPREAD


@dataclass(frozen=True)
class Identified:
    """What the data say about the coefficients.

    Attributes:
        mean: Of the coefficients, as a matrix like a prior mean, shape (E, P).
        columns: Of which inputs there are coefficients, shape (E, K).
        covariance: Of the coefficients, shape (E, K, K).
    """

    mean: Array
    columns: NDArray[np.intp]
    covariance: Array


def identify(
    part: LinearPart,
    inputs: Array,
    targets: Array,
    hyperparameters: Hyperparameters,
    threads: int = 1,
) -> Identified:
    """Return the coefficients' posterior.

    Args:
        part: Of what there are coefficients.
        inputs: X, of shape (n, P).
        targets: y, of shape (n, E).
        hyperparameters: Of E outputs and P inputs, with `log_linear`.
        threads: How many threads may work.

    Raises:
        NumericalError: if a kernel matrix is not positive definite whatever the jitter.
    """
    assert hyperparameters.log_linear is not None
    n, outputs = targets.shape
    scale = np.exp(hyperparameters.log_linear)
    size = part.columns.shape[1]
    mean = np.zeros((outputs, inputs.shape[1]))
    covariance = np.empty((outputs, size, size))

    def one_output(a: int) -> None:
        signal = float(hyperparameters.signal_variance[a])
        kernel = squared_exponential(
            inputs, inputs, np.exp(hyperparameters.log_lengthscales[a]), signal
        )
        kernel[range(n), range(n)] += hyperparameters.noise_variance[a]
        factor, _ = jittered_cholesky(kernel, signal)
        inverse_factor = triangular_inverse(factor)
        whitened = inverse_factor @ part.of(inputs, a)
        posterior = np.linalg.inv(np.eye(size) / scale[a] ** 2 + whitened.T @ whitened)
        theta = posterior @ (whitened.T @ (inverse_factor @ targets[:, a]))
        mean[a, part.columns[a]] = part.scales[a] * theta
        covariance[a] = np.outer(part.scales[a], part.scales[a]) * posterior

    for_each_output(one_output, outputs, n, threads)
    return Identified(mean, part.columns, covariance)
