"""What a way of imitating has to say; everything else about it follows from that."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from irlpilco_ros.learning.costs.base import Cost, StepwiseCost, discounts
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.registry import Extension, Registry
from irlpilco_ros.learning.task import Task


@dataclass(frozen=True)
class Imitation(Extension, ABC):
    """A way of imitating; `imitation` of the learning settings names one.

    Attributes:
        settings: Its own settings, an instance of `Settings`.
        discount: gamma, the weight of each step relative to the one before.
        warm_up: Name of the way that a search goes before this one; "" if none does.
    """

    settings: Any
    discount: float
    warm_up: ClassVar[str] = ""

    def deviation(self, differences: Array) -> Array:
        """Return how far a trial was from the demonstration in each feature: psi >= 0, shape (k,).

        The cost weights follow from it (thesis (4.5)-(4.6)). Here step by step,
        sum_t gamma^t difference[t]^2.

        Args:
            differences: Features of the trial less those of the demonstration, each divided by
                its typical size, t = 0..H, shape (H + 1, k).
        """
        psi: Array = self.discounts(len(differences) - 1) @ differences**2
        return psi

    @abstractmethod
    def cost(self, task: Task, weights: Array) -> Cost:
        """Return the expected cost that policy search minimises.

        Args:
            task: With demonstrations.
            weights: w >= 0 of the features as they are, shape (k,).
        """

    def stepwise_cost(self, task: Task, weights: Array) -> StepwiseCost | None:
        """Return the cost over any horizon, for `horizon_stages`; None if only the whole counts."""
        return None

    def discounts(self, horizon: int) -> Array:
        """Return gamma^t for t = 0..H, with 0 for t = 0, shape (H + 1,)."""
        return discounts(self.discount, horizon)


REGISTRY: Registry[Imitation] = Registry(
    "irlpilco_ros.imitation",
    Imitation,  # type: ignore[type-abstract]
)
"""What `imitation` of the learning settings may be."""
