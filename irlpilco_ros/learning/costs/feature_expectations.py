"""Feature expectations (thesis (3.1)-(3.2), (4.13)-(4.14)): only their discounted sum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.costs.base import CostValue, discounts, predicted_features
from irlpilco_ros.learning.costs.feature_matching import SCALE
from irlpilco_ros.learning.features import Features
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class FeatureExpectations:
    """J = alpha w'(mu - mu_E)^2, mu = sum_t gamma^t E phi[t].

    Attributes:
        features: What is compared.
        reference: phi_E[t] of the demonstration, t = 0..H, shape (H + 1, k).
        weights: w >= 0, shape (k,).
        discount: gamma.
    """

    features: Features
    reference: Array
    weights: Array
    discount: float = 1.0

    def evaluate(self, means: Array, covariances: Array) -> CostValue:
        """Return the cost of means (H + 1, D) and covariances (H + 1, D, D)."""
        predicted = predicted_features(self.features, means, covariances)
        factors = discounts(self.discount, len(means) - 1)
        deviation = factors @ (predicted.means - self.reference)
        value = SCALE * float(self.weights @ deviation**2)
        features_bar = np.outer(factors, 2.0 * SCALE * self.weights * deviation)
        spread_bar = np.zeros_like(predicted.covariances)
        means_bar, covariances_bar = predicted.pull(features_bar, spread_bar)

        def curvature_root(mean_sensitivities: Array) -> Array:
            total = np.tensordot(factors, predicted.sensitivities(mean_sensitivities), axes=1)
            root: Array = np.sqrt(2.0 * SCALE * self.weights)[:, None] * total
            return root

        return CostValue(value, means_bar, covariances_bar, curvature_root)
