"""Imitating step by step: the features at every time are to be those of the demonstration."""

from __future__ import annotations

from irlpilco_ros.learning.costs import FeatureMatching
from irlpilco_ros.learning.imitation.base import REGISTRY, Imitation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.task import Task


@REGISTRY.register("feature_matching")
class MatchFeatures(Imitation):
    """Feature matching (thesis (3.4)-(3.5), (5.5))."""

    def cost(self, task: Task, weights: Array) -> FeatureMatching:
        """Return the expected squared deviation, step by step."""
        return FeatureMatching(
            task.feature_map,
            task.reference_features(),
            weights,
            self.settings.variance_weight,
            self.settings.discount,
        )

    def stepwise_cost(self, task: Task, weights: Array) -> FeatureMatching:
        """Return the same cost: it is a sum over steps."""
        return self.cost(task, weights)
