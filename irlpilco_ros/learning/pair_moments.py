"""Exact covariances between two different GP outputs a, b at a Gaussian input.

With D = Lambda^-1 of each output, L = D_a + D_b, K = (S + L^-1)^-1 and T = L^-1 - L^-1 K L^-1
(which is (S^-1 + L)^-1, also for a singular S):

    e_ai = log s_a^2 - 1/4 log|I + S L| - 1/2 z_i'D_a z_i + 1/2 z_i'D_a T D_a z_i
    Q_ij = beta_ai beta_bj exp(e_ai + e_bj + z_i'D_a T D_b z_j)      r = Q1      c = Q'1
    cov = sum Q - M_a M_b
    dcov/dm = K L^-1 (D_a Z'r + D_b Z'c) - M_a V_b - M_b V_a
    dcov/dS = 1/2 K L^-1 [sum_ij Q_ij z_ij z_ij'] L^-1 K - 1/2 (sum Q) K
              - 1/2 (M_a Hess_b + M_b Hess_a)                 with z_ij = D_a z_i + D_b z_j
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gaussian import Array, symmetric
from irlpilco_ros.learning.linear_algebra import regularised_inverse
from irlpilco_ros.learning.output_moments import SMALLEST_EXPONENT, MeanMoments
from irlpilco_ros.learning.posterior import Posterior
from irlpilco_ros.learning.threads import run_parallel, scratch


@dataclass(frozen=True)
class PairMoments:
    """Covariances of all pairs of outputs, and their derivatives.

    Attributes:
        covariance: Of shape (E, E), symmetric, with a zero diagonal.
        first: Index a of each pair, of shape (p,).
        second: Index b of each pair, of shape (p,).
        by_mean: dcov/dm of each pair, of shape (p, P).
        by_covariance: dcov/dS of each pair, of shape (p, P, P), symmetric.
    """

    covariance: Array
    first: Array
    second: Array
    by_mean: Array
    by_covariance: Array

    def pullback(self, covariance_bar: Array) -> tuple[Array, Array]:
        """Pull a symmetric derivative by the covariance back to m (P,) and S (P, P)."""
        bars = 2.0 * covariance_bar[self.first, self.second]
        return bars @ self.by_mean, np.tensordot(bars, self.by_covariance, axes=1)


@dataclass(frozen=True)
class _Shared:
    """What all pairs have in common."""

    posterior: Posterior
    z: Array
    covariance: Array
    mean: Array
    jacobian: Array
    hessian: Array


def all_pairs(
    posterior: Posterior,
    mean: Array,
    covariance: Array,
    means: list[MeanMoments],
    gradient: bool,
    threads: int,
) -> PairMoments:
    """Return the exact covariances between all outputs, with their derivatives if wanted.

    Args:
        posterior: Of E outputs.
        mean: Mean of the input, of shape (P,).
        covariance: Covariance of the input, of shape (P, P).
        means: The blocks' `mean_moments` at the same input.
        gradient: False leaves the derivatives empty.
        threads: How many threads may work.
    """
    size = len(mean)
    first, second = np.triu_indices(posterior.outputs, k=1)
    shared = _Shared(
        posterior,
        posterior.points - mean,
        covariance,
        np.concatenate([block.mean for block in means]),
        np.concatenate([block.jacobian for block in means]),
        np.concatenate([block.hessian for block in means]),
    )
    values = np.zeros(len(first))
    by_mean = np.empty((len(first), size if gradient else 0))
    by_covariance = np.empty((len(first), *by_mean.shape[1:], *by_mean.shape[1:]))

    def one_pair(index: int) -> None:
        pair = _one_pair(shared, int(first[index]), int(second[index]), gradient)
        values[index] = pair[0]
        if gradient:
            by_mean[index], by_covariance[index] = pair[1], pair[2]

    run_parallel(one_pair, range(len(first)), threads)
    result = np.zeros((posterior.outputs, posterior.outputs))
    result[first, second] = values
    result[second, first] = values
    return PairMoments(result, first, second, by_mean, by_covariance)


def _one_pair(shared: _Shared, a: int, b: int, gradient: bool) -> tuple[float, Array, Array]:
    posterior = shared.posterior
    z_a, z_b = shared.z[a % len(shared.z)], shared.z[b % len(shared.z)]
    d_a = 1.0 / posterior.lengthscales_squared[a]
    d_b = 1.0 / posterior.lengthscales_squared[b]
    inverse = 1.0 / (d_a + d_b)
    stack, log_determinants = regularised_inverse(shared.covariance, inverse[None])
    k = stack[0]
    t = np.diag(inverse) - inverse[:, None] * k * inverse
    n, size = z_a.shape
    left, right = scratch("left", (n, size + 2)), scratch("right", (n, size + 2))
    right[:, :size] = z_b * d_b
    at = (z_a * d_a) @ t
    left[:, :size] = at
    e_a = 0.5 * np.sum(at * (z_a * d_a), axis=1) - 0.5 * (z_a * z_a) @ d_a
    e_b = 0.5 * np.sum((right[:, :size] @ t) * right[:, :size], axis=1) - 0.5 * (z_b * z_b) @ d_b
    e_a += np.log(posterior.signal_variance[a]) - 0.25 * log_determinants[0]
    e_b += np.log(posterior.signal_variance[b]) - 0.25 * log_determinants[0]
    left[:, size], left[:, size + 1] = e_a, 1.0
    right[:, size], right[:, size + 1] = 1.0, e_b
    pairs = np.matmul(left, right.T, out=scratch("pairs", (n, n)))
    np.maximum(pairs, SMALLEST_EXPONENT, out=pairs)
    np.exp(pairs, out=pairs)
    weights_a, weights_b = posterior.weights[a], posterior.weights[b]
    columns = weights_b * (weights_a @ pairs)
    total = float(columns.sum())
    value = total - shared.mean[a] * shared.mean[b]
    if not gradient:
        return value, np.empty(0), np.empty((0, 0))
    products = (pairs @ (right[:, : size + 1] * weights_b[:, None])) * weights_a[:, None]
    rows = products[:, size]
    scaled_a, scaled_b = z_a * d_a, right[:, :size]
    moment = scaled_a.T @ (rows[:, None] * scaled_a + 2.0 * products[:, :size])
    moment += scaled_b.T @ (columns[:, None] * scaled_b)
    turn = k * inverse
    by_mean = turn @ (rows @ scaled_a + columns @ scaled_b)
    by_mean -= shared.mean[a] * shared.jacobian[b] + shared.mean[b] * shared.jacobian[a]
    by_covariance = turn @ symmetric(moment) @ turn.T - total * k
    by_covariance -= shared.mean[a] * shared.hessian[b] + shared.mean[b] * shared.hessian[a]
    return value, by_mean, 0.5 * by_covariance
