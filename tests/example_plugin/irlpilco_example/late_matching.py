"""A way of imitating: the later a step, the more it matters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.costs import FeatureMatching
from irlpilco_ros.learning.imitation import Imitation
from irlpilco_ros.learning.settings import setting


class LateMatching(Imitation):
    """Feature matching in which the end of a motion counts most."""

    @dataclass(frozen=True)
    class Settings:
        growth: float = setting(1.2, "Weight of a step relative to the one before.", minimum=1.0)

    def deviation(self, differences):
        """Return the squared differences (H + 1, k), weighted and added up."""
        return self.settings.growth ** np.arange(len(differences)) @ differences**2

    def cost(self, task, weights):
        """Return the expected value of the same."""
        reference = task.reference_features()
        return FeatureMatching(task.feature_map, reference, weights, discount=self.settings.growth)
