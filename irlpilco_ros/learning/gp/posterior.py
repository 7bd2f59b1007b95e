"""What the training set says: a GP conditioned on data (2.22-2.24), ready for prediction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import jittered_cholesky, triangular_inverse
from irlpilco_ros.learning.numerics.sharing import for_each_output


@dataclass(frozen=True)
class Posterior:
    """Independent GP posteriors of E outputs, supported by n points.

    Mean k(x, X) weights, variance k(x, x) - k(x, X) inverse k(X, x).

    Attributes:
        points: Supporting points in columns, of shape (1, P, n) if all outputs share them, else
            (E, P, n).
        lengthscales_squared: Squared length-scales, of shape (E, P).
        signal_variance: Variances of the latent functions, of shape (E,).
        weights: beta, of shape (E, n).
        inverse: K^-1, or what stands in its place, of shape (E, n, n).
        notes: What had to be done to the matrices, in words; empty if nothing.
    """

    points: Array
    lengthscales_squared: Array
    signal_variance: Array
    weights: Array
    inverse: Array
    notes: tuple[str, ...] = ()

    @property
    def outputs(self) -> int:
        """Number of outputs E."""
        return len(self.weights)


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
    inverse = np.empty((outputs, n, n))

    def one_output(a: int) -> float:
        signal = float(hyperparameters.signal_variance[a])
        kernel = squared_exponential(
            inputs, inputs, np.exp(hyperparameters.log_lengthscales[a]), signal
        )
        kernel[range(n), range(n)] += hyperparameters.noise_variance[a]
        factor, jitter = jittered_cholesky(kernel, signal)
        inverse_factor = triangular_inverse(factor)
        weights[a] = inverse_factor.T @ (inverse_factor @ targets[:, a])
        np.matmul(inverse_factor.T, inverse_factor, out=inverse[a])
        return jitter

    jitters = for_each_output(one_output, outputs, n, threads)
    return Posterior(
        points=np.ascontiguousarray(inputs.T)[None],
        lengthscales_squared=hyperparameters.lengthscales_squared,
        signal_variance=hyperparameters.signal_variance,
        weights=weights,
        inverse=inverse,
        notes=jitter_notes(jitters),
    )


def jitter_notes(jitters: Sequence[float]) -> tuple[str, ...]:
    """Say in words which outputs' kernel matrices needed jitter."""
    return tuple(
        f"output {a}: the kernel matrix needed a jitter of {jitter:g} of the signal variance"
        for a, jitter in enumerate(jitters)
        if jitter
    )
