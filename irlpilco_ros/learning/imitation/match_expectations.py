"""Imitating on the whole: the features are to add up to those of the demonstration."""

from __future__ import annotations

from irlpilco_ros.learning.costs import FeatureExpectations
from irlpilco_ros.learning.imitation.base import REGISTRY, Imitation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.task import Task


@REGISTRY.register("feature_expectations")
class MatchExpectations(Imitation):
    """Feature expectations (thesis (3.1)-(3.2), (4.13)-(4.14))."""

    def deviation(self, differences: Array) -> Array:
        """Return (sum_t gamma^t difference[t])^2."""
        psi: Array = (self.discounts(len(differences) - 1) @ differences) ** 2
        return psi

    def cost(self, task: Task, weights: Array) -> FeatureExpectations:
        """Return the squared deviation of the discounted sum."""
        reference = task.reference_features()
        return FeatureExpectations(task.feature_map, reference, weights, self.discount)
