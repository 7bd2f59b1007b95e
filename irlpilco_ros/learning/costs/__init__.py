"""Costs of predicted trajectories: imitation (IRL/PILCO) and tasks (PILCO)."""

from irlpilco_ros.learning.costs.base import Cost, CostValue, StepwiseCost
from irlpilco_ros.learning.costs.feature_expectations import FeatureExpectations
from irlpilco_ros.learning.costs.feature_matching import FeatureMatching
from irlpilco_ros.learning.costs.state_costs import StateCost, quadratic_loss, saturating_loss
from irlpilco_ros.learning.costs.trajectory_kl import TrajectoryKl

__all__ = [
    "Cost",
    "CostValue",
    "FeatureExpectations",
    "FeatureMatching",
    "StateCost",
    "StepwiseCost",
    "TrajectoryKl",
    "quadratic_loss",
    "saturating_loss",
]
