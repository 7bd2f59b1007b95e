"""Imitating step by step: the features at every time are to be those of the demonstration."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.costs import FeatureMatching
from irlpilco_ros.learning.imitation.base import REGISTRY, Imitation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import setting
from irlpilco_ros.learning.task import Task


@REGISTRY.register("feature_matching")
class MatchFeatures(Imitation):
    """Feature matching (thesis (3.4)-(3.5), (5.5))."""

    @dataclass(frozen=True)
    class Settings:
        """What the deviation at a step is made of."""

        variance_weight: float = setting(
            1.0,
            "How much the predicted variance of a feature adds to its cost (lambda). 1: policies "
            "with an uncertain prediction are avoided; 0: only the predicted mean counts (thesis).",
            minimum=0.0,
            maximum=1000.0,
        )

    def cost(self, task: Task, weights: Array) -> FeatureMatching:
        """Return the expected squared deviation, step by step."""
        return FeatureMatching(
            task.feature_map,
            task.reference_features(),
            weights,
            self.settings.options_of(MatchFeatures).variance_weight,
            self.settings.discount,
        )

    def stepwise_cost(self, task: Task, weights: Array) -> FeatureMatching:
        """Return the same cost: it is a sum over steps."""
        return self.cost(task, weights)
