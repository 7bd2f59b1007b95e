"""Feature matching (thesis (3.4)-(3.5), (5.5)): every step's features, one by one."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np

from irlpilco_ros.learning.costs.base import (
    CostValue,
    PredictedFeatures,
    discounts,
    predicted_features,
)
from irlpilco_ros.learning.features import Features
from irlpilco_ros.learning.numerics.arrays import Array

SCALE = 1000.0
"""alpha of thesis (5.5): keeps the cost of small deviations away from rounding."""


@dataclass(frozen=True)
class FeatureMatching:
    """J = alpha sum_t gamma^t w'(delta[t]^2 + lambda var phi[t]), delta[t] = E phi[t] - phi_E[t].

    Attributes:
        features: What is compared.
        reference: phi_E[t] of the demonstration, t = 0..H, shape (H + 1, k).
        weights: w >= 0, shape (k,).
        variance_weight: lambda: 0 is the thesis, 1 the expected squared deviation.
        discount: gamma.
    """

    features: Features
    reference: Array
    weights: Array
    variance_weight: float = 1.0
    discount: float = 1.0

    def evaluate(self, means: Array, covariances: Array) -> CostValue:
        """Return the cost of means (H + 1, D) and covariances (H + 1, D, D)."""
        predicted = predicted_features(self.features, means, covariances)
        factors = self._factors()
        deviations, squares = self._deviations(predicted)
        value = float(np.sum(factors * squares))
        spread_bar = self.variance_weight * factors[:, :, None] * np.eye(len(self.weights))
        means_bar, covariances_bar = predicted.pull(2.0 * factors * deviations, spread_bar)

        def curvature_root(mean_sensitivities: Array) -> Array:
            rows = predicted.sensitivities(mean_sensitivities)
            rows = np.sqrt(2.0 * factors)[:, :, None] * rows
            return rows.reshape(-1, rows.shape[-1])

        return CostValue(value, means_bar, covariances_bar, curvature_root)

    def steps(self, means: Array, covariances: Array) -> Array:
        """Return what each step t = 0..H adds to the cost, shape (H + 1,); arguments as above."""
        _, squares = self._deviations(predicted_features(self.features, means, covariances))
        added: Array = np.sum(self._factors() * squares, axis=1)
        return added

    def until(self, horizon: int) -> Self:
        """Return the cost of the first steps alone, t = 0..horizon."""
        return dataclasses.replace(self, reference=self.reference[: horizon + 1])

    def standing_still(self) -> float:
        """Return the cost of a step at the mean of the demonstration's features, on average."""
        return SCALE * float(self.weights @ self.reference.var(axis=0))

    def _factors(self) -> Array:
        """Return alpha gamma^t w, shape (H + 1, k)."""
        horizon = len(self.reference) - 1
        return SCALE * discounts(self.discount, horizon)[:, None] * self.weights

    def _deviations(self, predicted: PredictedFeatures) -> tuple[Array, Array]:
        """Return delta[t], and delta[t]^2 + lambda var phi[t], both of shape (H + 1, k)."""
        deviations = predicted.means - self.reference
        variances = np.diagonal(predicted.covariances, axis1=1, axis2=2)
        return deviations, deviations**2 + self.variance_weight * variances
