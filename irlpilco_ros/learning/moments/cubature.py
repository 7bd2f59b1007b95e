"""Spherical cubature: moments of any smooth function of a Gaussian, without tuning."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array

MeanPullback = Callable[[Array, Array], tuple[Array, Array]]
"""(mean_bar (k,), covariance_bar (k, k)) -> (input mean_bar (n,), input covariance_bar (n, n)):
features are the end of the chain, where nothing depends on their Jacobian."""

_JITTER = 1e-12


def cubature_moments(
    function: Callable[[Array], tuple[Array, Array]], state: Gaussian
) -> tuple[Moments, MeanPullback]:
    """Return the moments of a function at 2n points of equal weight, m +- sqrt(n) L e_i.

    Exact for polynomials of degree three (the mean); L is the Cholesky factor of the covariance.

    Args:
        function: Maps points (m, n) to values (m, k) and their Jacobians (m, k, n).
        state: Mean (n,) and covariance (n, n); a singular one is lifted by 1e-12 of its trace.

    Returns:
        Moments with mean (k,), covariance (k, k), Jacobian (k, n) (the mean of the points'
        Jacobians), and the pullback of mean and covariance.
    """
    n = len(state.mean)
    lift = _JITTER * max(float(np.trace(state.covariance)), _JITTER)
    lifted: Array = state.covariance + lift * np.eye(n)
    factor = np.asarray(np.linalg.cholesky(lifted), dtype=np.float64)
    offsets = np.sqrt(n) * np.hstack([factor, -factor]).T
    values, jacobians = function(state.mean + offsets)
    mean = values.mean(axis=0)
    deviations = values - mean
    covariance = deviations.T @ deviations / (2 * n)

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
        values_bar = (mean_bar + deviations @ (covariance_bar + covariance_bar.T)) / (2 * n)
        points_bar = np.einsum("mk,mkn->mn", values_bar, jacobians)
        offsets_bar = np.sqrt(n) * (points_bar[:n] - points_bar[n:]).T
        return points_bar.sum(axis=0), _cholesky_pullback(factor, offsets_bar)

    return Moments(mean, covariance, jacobians.mean(axis=0)), pullback


def _cholesky_pullback(factor: Array, factor_bar: Array) -> Array:
    """Return the symmetric adjoint of S for S = L L' (Murray 2016)."""
    inner = np.tril(factor.T @ np.tril(factor_bar))
    inner[np.diag_indices_from(inner)] *= 0.5
    inverse = np.linalg.inv(factor)
    full = inverse.T @ inner @ inverse
    return 0.5 * (full + full.T)
