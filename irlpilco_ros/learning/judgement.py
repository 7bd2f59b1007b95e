"""How far a trial was from the demonstration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.costs import Cost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task


@dataclass(frozen=True)
class Errors:
    """How far a trial was from the demonstration.

    Attributes:
        rmse: Root-mean-square error over features and steps t = 1..H, in the features' unit.
        mse: Its square, thesis (6.1).
    """

    rmse: float
    mse: float


def judge(task: Task, trial: Rollout) -> Errors:
    """Return how far a trial was from the demonstration (thesis (6.1)), over t = 1..H.

    Raises:
        InvalidSettingError: if the trial is not as long as the demonstration.
    """
    if trial.states.shape != (task.horizon + 1, task.state_size):
        raise InvalidSettingError(
            f"the trial's states have shape {trial.states.shape}; the task needs "
            f"{(task.horizon + 1, task.state_size)}"
        )
    deviations = task.feature_map.of(trial.states) - task.reference_features()
    mse = float(np.mean(deviations[1:] ** 2))
    return Errors(rmse=float(np.sqrt(mse)), mse=mse)


def trial_error(task: Task, trial: Rollout) -> float:
    """Return what the best of several trials has the least of: error (6.1), or a given cost.

    Raises:
        InvalidSettingError: as `judge`.
    """
    return judge(task, trial).mse if task.cost is None else cost_of_trial(task.cost, trial)


def cost_of_trial(cost: Cost, trial: Rollout) -> float:
    """Return the cost of what happened, as that of a prediction without spread."""
    steps, size = trial.states.shape
    return cost.evaluate(trial.states, np.zeros((steps, size, size))).value
