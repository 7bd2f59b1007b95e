"""Costs of a state on its own: saturating (classical PILCO) and quadratic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.costs.base import CostValue, discounts, predicted_features
from irlpilco_ros.learning.features import Features
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array, symmetric

Loss = Callable[[Gaussian, Array, Array], tuple[Array, Array, Array]]


def saturating_loss(state: Gaussian, target: Array, precision: Array) -> tuple[Array, Array, Array]:
    """Return E[1 - exp(-(x - x*)'W(x - x*)/2)] (thesis (2.43)) and its derivatives.

    Args:
        state: Mean (..., n) and covariance (..., n, n): one state, or one for each step.
        target: x*, shape (n,).
        precision: W, symmetric and positive semidefinite, shape (n, n).

    Returns:
        The loss in [0, 1], shape (...), its derivative by the mean (..., n) and by the covariance
        (..., n, n).
    """
    scale = np.eye(len(target)) + precision @ state.covariance  # scale^-1 W is symmetric
    tight = symmetric(np.asarray(np.linalg.solve(scale, precision), dtype=np.float64))
    deviation = state.mean - target
    pulled = (tight @ deviation[..., None])[..., 0]
    reward = np.exp(-0.5 * (deviation * pulled).sum(axis=-1)) / np.sqrt(np.linalg.det(scale))
    by_mean = reward[..., None] * pulled
    outer = pulled[..., :, None] * pulled[..., None, :]
    return 1.0 - reward, by_mean, 0.5 * reward[..., None, None] * (tight - outer)


def quadratic_loss(state: Gaussian, target: Array, precision: Array) -> tuple[Array, Array, Array]:
    """Return E[(x - x*)'W(x - x*)] and its derivatives, as `saturating_loss` does."""
    deviation = state.mean - target
    pulled = deviation @ precision  # W is symmetric
    value = (pulled * deviation).sum(axis=-1) + (precision * state.covariance).sum(axis=(-1, -2))
    return value, 2.0 * pulled, np.broadcast_to(precision, state.covariance.shape)


@dataclass(frozen=True)
class StateCost:
    """J = sum_t gamma^t loss(phi[t]), t = 1..H.

    Its curvature is that of the loss at the target, where it is positive semidefinite.

    Attributes:
        features: What the loss sees of the state.
        target: Wanted features, shape (k,).
        precision: W, symmetric, shape (k, k).
        loss: `saturating_loss` or `quadratic_loss`.
        discount: gamma.
    """

    features: Features
    target: Array
    precision: Array
    loss: Loss = saturating_loss
    discount: float = 1.0

    def evaluate(self, means: Array, covariances: Array) -> CostValue:
        """Return the cost of means (H + 1, D) and covariances (H + 1, D, D)."""
        predicted = predicted_features(self.features, means, covariances)
        factors = discounts(self.discount, len(means) - 1)
        seen = Gaussian(predicted.means, predicted.covariances)
        losses, by_means, by_covariances = self.loss(seen, self.target, self.precision)
        means_bar, covariances_bar = predicted.pull(
            factors[:, None] * by_means, factors[:, None, None] * by_covariances
        )

        def curvature_root(mean_sensitivities: Array) -> Array:
            root = np.linalg.cholesky(self._hessian() + 1e-12 * np.eye(len(self.target))).T
            rows = root @ predicted.sensitivities(mean_sensitivities)
            rows = np.sqrt(factors)[:, None, None] * rows
            return rows.reshape(-1, rows.shape[-1])

        return CostValue(float(factors @ losses), means_bar, covariances_bar, curvature_root)

    def _hessian(self) -> Array:
        """Return the Hessian by the features' means at the target, without spread, (k, k).

        Of any expectation over a Gaussian it is twice the derivative by the covariance.
        """
        certain = Gaussian(self.target, np.zeros_like(self.precision))
        return 2.0 * self.loss(certain, self.target, self.precision)[2]
