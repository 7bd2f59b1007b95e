"""Imitating a distribution: the predicted trajectory is to look like several demonstrations."""

from __future__ import annotations

from irlpilco_ros.learning.costs import TrajectoryKl
from irlpilco_ros.learning.imitation.base import REGISTRY, Imitation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.task import Task


@REGISTRY.register("trajectory_kl")
class MatchTrajectory(Imitation):
    """Kullback-Leibler divergence of trajectories (Englert et al. 2013).

    It is searched from where feature matching has come to: further off, where the deviation is many
    times the spread, it falls fastest by a wider prediction, and a search ends at policies that
    make the trajectory as uncertain as it is wrong.
    """

    warm_up = "feature_matching"

    def cost(self, task: Task, weights: Array) -> TrajectoryKl:
        """Return the divergence of the prediction from the demonstrations, without weights."""
        return TrajectoryKl(
            task.feature_map,
            task.reference_features(),
            task.reference_covariances(),
            task.feature_noise(),
            self.discount,
        )
