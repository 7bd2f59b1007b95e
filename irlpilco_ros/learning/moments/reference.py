"""The specification: moments of a GP at a Gaussian input, formula by formula.

`MomentMatching` computes the same, fast and with derivatives. The notation is that of
`output_moments` (2.34-2.45, Deisenroth & Rasmussen 2011).
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.gp.posterior import Posterior
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.numerics.arrays import Array


def reference_moments(
    posterior: Posterior, prior_mean: Array, x: Gaussian, approximation: CovarianceApproximation
) -> Moments:
    """Return the moments of A x + g(x) for x ~ N(m, S).

    Args:
        posterior: Of g, with E outputs.
        prior_mean: A, of shape (E, P).
        x: m of shape (P,) and S of shape (P, P), positive semi-definite.
        approximation: Of the covariances between different outputs of g.
    """
    E, S = posterior.outputs, x.covariance
    means, slopes = zip(*(_mean_and_slope(posterior, a, x) for a in range(E)), strict=True)
    M, V = np.array(means), np.array(slopes)
    C = V @ S @ V.T
    for a in range(E):
        C[a, a] = _mean_product(posterior, a, a, x) - M[a] ** 2
        if approximation == "exact":
            for b in range(a):
                C[a, b] = C[b, a] = _mean_product(posterior, a, b, x) - M[a] * M[b]
    A = prior_mean
    return Moments(A @ x.mean + M, C + A @ S @ V.T + V @ S @ A.T + A @ S @ A.T, A + V)


def _mean_and_slope(posterior: Posterior, a: int, x: Gaussian) -> tuple[float, Array]:
    """Return E[g_a(x)] = sum q and E[dg_a/dx] = P1 sum q_i z_i, of shape (P,)."""
    S, z = x.covariance, _points(posterior, a) - x.mean
    Lambda = np.diag(posterior.lengthscales_squared[a])
    P1 = _inverse(Lambda + S)
    height = posterior.signal_variance[a] / np.sqrt(
        np.linalg.det(np.eye(len(S)) + S @ _inverse(Lambda))
    )
    q = posterior.weights[a] * height * np.exp(-0.5 * _squares(z, P1))
    return float(q.sum()), P1 @ (q @ z)


def _mean_product(posterior: Posterior, a: int, b: int, x: Gaussian) -> float:
    """Return E[g_a(x) g_b(x)] = sum_ij (beta_ai beta_bj - [a = b] K^-1_ij) W_ij + [a = b] s^2.

    W_ij = E[k_a(x, x_i) k_b(x, x_j)]. The product of the two bells is one bell in x, about y_ij and
    with the precision D = D_a + D_b, that is lower the further x_i and x_j are apart; its
    expectation is a Gaussian integral.
    """
    S, z_a, z_b = x.covariance, _points(posterior, a) - x.mean, _points(posterior, b) - x.mean
    D_a = np.diag(1.0 / posterior.lengthscales_squared[a])
    D_b = np.diag(1.0 / posterior.lengthscales_squared[b])
    D = D_a + D_b
    y = ((z_a @ D_a)[:, None] + (z_b @ D_b)[None]) @ _inverse(D)
    apart = _squares(z_a, D_a)[:, None] + _squares(z_b, D_b)[None] - _squares(y, D)
    height = posterior.signal_variance[a] * posterior.signal_variance[b]
    height /= np.sqrt(np.linalg.det(np.eye(len(S)) + S @ D))
    W = height * np.exp(-0.5 * (apart + _squares(y, _inverse(_inverse(D) + S))))
    weights = np.outer(posterior.weights[a], posterior.weights[b])
    if a != b:
        return float(np.sum(weights * W))
    return float(np.sum((weights - posterior.inverse[a]) * W) + posterior.signal_variance[a])


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _squares(z: Array, M: Array) -> Array:
    """Return z'M z for all vectors of an array (..., P)."""
    squares: Array = ((z @ M) * z).sum(axis=-1)
    return squares


def _points(posterior: Posterior, a: int) -> Array:
    """Return the points that support an output, of shape (n, P)."""
    shared = len(posterior.points) == 1
    points: Array = posterior.points[0 if shared else a].T
    return points
