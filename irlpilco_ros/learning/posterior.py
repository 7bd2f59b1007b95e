"""What the training set says: a GP conditioned on data (2.22-2.24), ready for prediction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irlpilco_ros.learning.gaussian import Array
from irlpilco_ros.learning.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.linear_algebra import jittered_cholesky, triangular_inverse
from irlpilco_ros.learning.threads import one_blas_thread, run_parallel

_BLOCK_ELEMENTS = 65536  # n x n values worked on together: half a MiB, so that they stay in cache


@dataclass(frozen=True)
class Posterior:
    """Independent GP posteriors of E outputs, supported by n points.

    Mean k(x, X) weights, variance k(x, x) - k(x, X) inverse k(X, x).

    Attributes:
        points: Supporting points X, of shape (1, n, P) if shared by all outputs, else (E, n, P).
        lengthscales_squared: Squared length-scales, of shape (E, P).
        signal_variance: Variances of the latent functions, of shape (E,).
        weights: beta, of shape (E, n).
        pair_weights: beta beta' - inverse, of shape (E, n, n).
        notes: What had to be done to the matrices, in words; empty if nothing.
    """

    points: Array
    lengthscales_squared: Array
    signal_variance: Array
    weights: Array
    pair_weights: Array
    notes: tuple[str, ...] = ()

    @property
    def outputs(self) -> int:
        """Number of outputs E."""
        return len(self.weights)

    @cached_property
    def blocks(self) -> tuple[Posterior, ...]:
        """The outputs in groups that are worked on together.

        The grouping depends on sizes alone, never on threads, so that results do not either.
        """
        group = max(1, _BLOCK_ELEMENTS // self.weights.shape[1] ** 2)
        count = -(-self.outputs // group)
        return tuple(self._select(part) for part in np.array_split(range(self.outputs), count))

    def _select(self, part: Array) -> Posterior:
        chosen = slice(int(part[0]), int(part[-1]) + 1)
        return replace(
            self,
            points=self.points if len(self.points) == 1 else self.points[chosen],
            lengthscales_squared=self.lengthscales_squared[chosen],
            signal_variance=self.signal_variance[chosen],
            weights=self.weights[chosen],
            pair_weights=self.pair_weights[chosen],
        )


def condition(
    inputs: Array, targets: Array, hyperparameters: Hyperparameters, threads: int = 1
) -> Posterior:
    """Condition zero-mean GPs on data: beta = K^-1 y with K = k(X, X) + noise (2.22-2.24).

    Args:
        inputs: X, of shape (n, P).
        targets: y, of shape (n, E).
        hyperparameters: Of E outputs and P inputs.
        threads: How many threads may work.

    Raises:
        NumericalError: if a kernel matrix is not positive definite whatever the jitter.
    """
    n, outputs = targets.shape
    weights = np.empty((outputs, n))
    pair_weights = np.empty((outputs, n, n))

    def one_output(a: int) -> float:
        signal = float(hyperparameters.signal_variance[a])
        kernel = squared_exponential(
            inputs, inputs, np.exp(hyperparameters.log_lengthscales[a]), signal
        )
        kernel[range(n), range(n)] += hyperparameters.noise_variance[a]
        factor, jitter = jittered_cholesky(kernel, signal)
        inverse_factor = triangular_inverse(factor)
        weights[a] = inverse_factor.T @ (inverse_factor @ targets[:, a])
        np.matmul(inverse_factor.T, inverse_factor, out=pair_weights[a])
        np.subtract(np.outer(weights[a], weights[a]), pair_weights[a], out=pair_weights[a])
        return jitter

    with one_blas_thread():
        jitters = run_parallel(one_output, range(outputs), threads)
    return Posterior(
        points=inputs[None],
        lengthscales_squared=hyperparameters.lengthscales_squared,
        signal_variance=hyperparameters.signal_variance,
        weights=weights,
        pair_weights=pair_weights,
        notes=jitter_notes(jitters),
    )


def jitter_notes(jitters: list[float]) -> tuple[str, ...]:
    """Say in words which outputs' kernel matrices needed jitter."""
    return tuple(
        f"output {a}: the kernel matrix needed a jitter of {jitter:g} of the signal variance"
        for a, jitter in enumerate(jitters)
        if jitter
    )
