"""What the training set says: a GP conditioned on data (2.22-2.24), ready for prediction."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import (
    jittered_cholesky,
    triangular_inverse,
    useful_threads,
)
from irlpilco_ros.learning.numerics.threads import one_blas_thread, run_parallel

_GROUPS = 2  # of outputs, which threads share out; more would make each numpy call too short
_WORTH_SHARING = 3_000_000  # multiplications; one thread is as fast with fewer, in one group
_STRIP = 60  # columns of an n x n matrix that are worked on together


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
        pair_weights: beta beta' - inverse, symmetric, in strips (see `strip_weights`).
        notes: What had to be done to the matrices, in words; empty if nothing.
    """

    points: Array
    lengthscales_squared: Array
    signal_variance: Array
    weights: Array
    pair_weights: tuple[Array, ...]
    notes: tuple[str, ...] = ()

    @property
    def outputs(self) -> int:
        """Number of outputs E."""
        return len(self.weights)

    @cached_property
    def strips(self) -> tuple[tuple[int, int], ...]:
        """First and last column (exclusive) of the strips that an n x n matrix is cut into.

        Of a symmetric one, sums over all pairs of points need each strip's columns only down to
        the end of its diagonal block.
        """
        return strips(self.weights.shape[1])

    @cached_property
    def groups(self) -> tuple[slice, ...]:
        """The outputs in groups that are worked on together, for threads to share out.

        The grouping depends on sizes alone, never on threads, so that results do not either.
        """
        size, n = self.points.shape[1:]
        worth_it = self.outputs * n * n * size > _WORTH_SHARING
        count = min(_GROUPS, self.outputs) if worth_it else 1
        edges = np.linspace(0, self.outputs, count + 1).astype(int)
        return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(edges))


def strips(n: int) -> tuple[tuple[int, int], ...]:
    """Cut n columns into strips of about equal width."""
    edges = np.linspace(0, n, max(1, round(n / _STRIP)) + 1).astype(int)
    return tuple((int(a), int(b)) for a, b in itertools.pairwise(edges))


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
    inverses = np.empty((outputs, n, n))

    def one_output(a: int) -> float:
        signal = float(hyperparameters.signal_variance[a])
        kernel = squared_exponential(
            inputs, inputs, np.exp(hyperparameters.log_lengthscales[a]), signal
        )
        kernel[range(n), range(n)] += hyperparameters.noise_variance[a]
        factor, jitter = jittered_cholesky(kernel, signal)
        inverse_factor = triangular_inverse(factor)
        weights[a] = inverse_factor.T @ (inverse_factor @ targets[:, a])
        np.matmul(inverse_factor.T, inverse_factor, out=inverses[a])
        return jitter

    with one_blas_thread():
        jitters = run_parallel(one_output, range(outputs), useful_threads(n, threads))
    return Posterior(
        points=np.ascontiguousarray(inputs.T)[None],
        lengthscales_squared=hyperparameters.lengthscales_squared,
        signal_variance=hyperparameters.signal_variance,
        weights=weights,
        pair_weights=strip_weights(weights, inverses),
        notes=jitter_notes(jitters),
    )


def strip_weights(weights: Array, inverses: Array) -> tuple[Array, ...]:
    """Return beta beta' - inverse, symmetric, in strips of columns for sums over all pairs.

    Each strip is an array of its own, in memory as it is read, and ends with its diagonal block:
    what is above that is doubled, for its mirror image.

    Args:
        weights: beta, of shape (E, n).
        inverses: Of shape (E, n, n).

    Returns:
        For each strip an array of shape (E, stop, stop - start).
    """
    found = []
    for start, stop in strips(weights.shape[1]):
        strip = weights[:, :stop, None] * weights[:, None, start:stop]
        strip -= inverses[:, :stop, start:stop]
        strip[:, :start] *= 2.0
        found.append(strip)
    return tuple(found)


def jitter_notes(jitters: Sequence[float]) -> tuple[str, ...]:
    """Say in words which outputs' kernel matrices needed jitter."""
    return tuple(
        f"output {a}: the kernel matrix needed a jitter of {jitter:g} of the signal variance"
        for a, jitter in enumerate(jitters)
        if jitter
    )
