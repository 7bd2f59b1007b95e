"""IRL/PILCO (thesis Algorithm 3) as pure functions: recorded trials in, next policy out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.iteration import Errors, Iteration, Progress
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.policies import OpenLoopPolicy, Policy
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task

__all__ = [
    "Errors",
    "Iteration",
    "LearningSettings",
    "Progress",
    "Rollout",
    "Task",
    "initial_policy",
    "judge",
    "learn",
    "open_loop_policy",
]


def initial_policy(task: Task, settings: LearningSettings) -> Policy:
    """Return the policy of the first trial (thesis Algorithm 3, line 2)."""
    raise NotImplementedError


def open_loop_policy(task: Task) -> OpenLoopPolicy:
    """Return the replay of the demonstration's own speeds: the baseline of all learning."""
    joints = task.control_size
    positions = task.reference_states()[:, :joints]
    speeds = np.diff(positions, axis=0) / task.dt
    controls = np.clip(speeds, -task.control_limit, task.control_limit)
    return OpenLoopPolicy(controls, task.control_limit, task.state_size)


def learn(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    previous: Iteration | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Iteration:
    """Do one pass of Algorithm 3 on all trials so far and return what it found."""
    raise NotImplementedError


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
