"""Imitating step by step: the features at every time are to be those of the demonstration."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.costs import FeatureMatching
from irlpilco_ros.learning.imitation.base import REGISTRY, Imitation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.learning.task import Task


@dataclass(frozen=True)
class MatchFeaturesSettings:
    """How much what the model does not know counts."""

    variance_weight: float = setting(
        1.0,
        "How much the predicted variance of a feature adds to its cost (lambda). 1: the cost is "
        "the expected squared deviation, so that policies with a vague prediction are avoided; "
        "0: only the predicted mean counts, as in the thesis.",
        minimum=0.0,
        maximum=1000.0,
    )

    def __post_init__(self) -> None:
        check(self)


@REGISTRY.register("feature_matching")
class MatchFeatures(Imitation):
    """Feature matching (thesis (3.4)-(3.5), (5.5))."""

    Settings = MatchFeaturesSettings
    settings: MatchFeaturesSettings

    def cost(self, task: Task, weights: Array) -> FeatureMatching:
        """Return the expected squared deviation, step by step."""
        return FeatureMatching(
            task.feature_map,
            task.reference_features(),
            weights,
            self.settings.variance_weight,
            self.discount,
        )

    def stepwise_cost(self, task: Task, weights: Array) -> FeatureMatching:
        """Return the same cost: it is a sum over steps."""
        return self.cost(task, weights)
