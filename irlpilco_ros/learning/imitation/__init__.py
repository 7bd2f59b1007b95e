"""What imitation means: the ways of comparing a trial, and a prediction, with the demonstration."""

from irlpilco_ros.learning.imitation.base import REGISTRY, Imitation
from irlpilco_ros.learning.imitation.match_expectations import MatchExpectations
from irlpilco_ros.learning.imitation.match_features import MatchFeatures
from irlpilco_ros.learning.imitation.match_trajectory import MatchTrajectory

__all__ = [
    "REGISTRY",
    "Imitation",
    "MatchExpectations",
    "MatchFeatures",
    "MatchTrajectory",
]
