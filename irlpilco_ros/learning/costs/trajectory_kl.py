"""Trajectory matching by Kullback-Leibler divergence (Englert et al. 2013)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.costs.base import CostValue, discounts, predicted_features
from irlpilco_ros.learning.features import Features
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class TrajectoryKl:
    """J = sum_t gamma^t KL(N_E[t] || N[t]), both as a sensor would see them.

    Attributes:
        features: What is compared.
        reference: Means of the demonstration's features, t = 0..H, shape (H + 1, k).
        reference_covariances: Their covariances, sensor noise included, shape (H + 1, k, k).
        noise: Sensor noise of the features, added to the prediction, shape (k, k).
        discount: gamma.
    """

    features: Features
    reference: Array
    reference_covariances: Array
    noise: Array
    discount: float = 1.0

    def evaluate(self, means: Array, covariances: Array) -> CostValue:
        """Return the cost of means (H + 1, D) and covariances (H + 1, D, D)."""
        predicted = predicted_features(self.features, means, covariances)
        factors = discounts(self.discount, len(means) - 1)
        seen = predicted.covariances + self.noise
        inverse = np.linalg.inv(seen)
        deviations = predicted.means - self.reference
        pulled = np.einsum("tij,tj->ti", inverse, deviations)
        divergence = 0.5 * (
            np.einsum("tij,tji->t", inverse, self.reference_covariances)
            + np.sum(deviations * pulled, axis=1)
            - deviations.shape[1]
            + np.linalg.slogdet(seen)[1]
            - np.linalg.slogdet(self.reference_covariances)[1]
        )
        mismatch = inverse @ self.reference_covariances @ inverse
        mismatch = mismatch + pulled[:, :, None] * pulled[:, None, :]
        spread_bar = 0.5 * factors[:, None, None] * (inverse - mismatch)
        means_bar, covariances_bar = predicted.pull(factors[:, None] * pulled, spread_bar)

        def curvature_root(mean_sensitivities: Array) -> Array:
            root = np.swapaxes(np.linalg.cholesky(inverse), 1, 2)
            rows = root @ predicted.sensitivities(mean_sensitivities)
            rows = np.sqrt(factors)[:, None, None] * rows
            return rows.reshape(-1, rows.shape[-1])

        return CostValue(float(factors @ divergence), means_bar, covariances_bar, curvature_root)
