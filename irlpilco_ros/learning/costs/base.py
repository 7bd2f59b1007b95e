"""What a cost of a predicted trajectory gives to policy search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from irlpilco_ros.learning.features import Features
from irlpilco_ros.learning.moments.cubature import MeanPullback
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class CostValue:
    """A cost and its derivatives by the predicted states.

    Attributes:
        value: The cost.
        means_bar: Derivative by the means, shape (H + 1, D).
        covariances_bar: Derivative by the covariances, symmetric, shape (H + 1, D, D).
        curvature_root: From d m[t] / d theta (H + 1, D, p) to a root R (r, p) of the Gauss-Newton
            curvature: the Hessian by theta is about R'R.
    """

    value: float
    means_bar: Array
    covariances_bar: Array
    curvature_root: Callable[[Array], Array]


class Cost(Protocol):
    """A cost of a predicted trajectory."""

    def evaluate(self, means: Array, covariances: Array) -> CostValue:
        """Return the cost of means (H + 1, D) and covariances (H + 1, D, D)."""


class StepwiseCost(Cost, Protocol):
    """A cost that is a sum over steps, so that it can be looked at over part of a trial."""

    def until(self, horizon: int) -> Self:
        """Return the cost of the first steps alone, t = 0..horizon."""

    def steps(self, means: Array, covariances: Array) -> Array:
        """Return what each step t = 0..H adds to the cost, shape (H + 1,)."""

    def standing_still(self) -> float:
        """Return what a step costs on average that stays in the middle of the demonstration."""


@dataclass(frozen=True)
class PredictedFeatures:
    """The features' moments along a predicted trajectory, t = 0..H.

    Attributes:
        means: E phi[t], shape (H + 1, k).
        covariances: Cov phi[t], shape (H + 1, k, k).
        jacobians: E d phi[t] / d x[t], shape (H + 1, k, D).
        pull: From the adjoints of means and covariances to those of the states' means (H + 1, D)
            and covariances (H + 1, D, D).
    """

    means: Array
    covariances: Array
    jacobians: Array
    pull: MeanPullback

    def sensitivities(self, mean_sensitivities: Array) -> Array:
        """Return d E phi[t] / d theta along the expected Jacobians, shape (H + 1, k, p)."""
        sensitivities: Array = self.jacobians @ mean_sensitivities
        return sensitivities


def predicted_features(features: Features, means: Array, covariances: Array) -> PredictedFeatures:
    """Return the features' moments at every state of a predicted trajectory."""
    moments, pull = features.moments_along(Gaussian(means, covariances))
    return PredictedFeatures(moments.mean, moments.covariance, moments.jacobian, pull)


def discounts(discount: float, horizon: int) -> Array:
    """Return gamma^t for t = 0..H, with 0 for t = 0: the start is not the policy's doing."""
    factors: Array = discount ** np.arange(horizon + 1.0)
    factors[0] = 0.0
    return factors
