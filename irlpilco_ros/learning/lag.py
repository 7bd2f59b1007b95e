"""How many of its last commands a robot's state has to hold, by the evidence of its first trial.

A robot that lags answers to commands of periods ago. Each joint's motion is explained linearly by
its speed, its command and the h commands before, y ~ N(0, b^2 ZZ' + s^2 I) (Rasmussen & Williams
2006, section 2.1); the h of largest evidence, b and s being the best ones, is taken. More commands
than the delay asks for cost evidence, because they explain nothing.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.prior_mean import servo_part, velocity_mean
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task

CHOSEN = -1
"""Value of the setting `command_history` that leaves the choice to the first trial."""

_LARGEST = 4


def with_known_history(
    task: Task, settings: LearningSettings, trials: Sequence[Rollout]
) -> LearningSettings:
    """Return settings whose `command_history` is a number, chosen by the first trial if need be.

    Args:
        task: What is learned.
        settings: How.
        trials: In the order they were made, one at least.

    Raises:
        InvalidSettingError: a joint is not commanded, so that nothing is known of how it answers.
    """
    if settings.command_history != CHOSEN:
        return settings
    longest = min(_LARGEST, trials[0].steps // 4)
    found = [_evidence(task, trials[0], history) for history in range(longest + 1)]
    return dataclasses.replace(settings, command_history=int(np.argmax(found)))


def _evidence(task: Task, trial: Rollout, history: int) -> float:
    """Return the log evidence of all outputs together."""
    layout = task.state_layout.remembering(task.control_size, history)
    part = servo_part(layout, task.control_size, task.dt)
    states = layout.whole_states(trial.states, trial.controls)[:-1]
    inputs = np.hstack([layout.dynamics_view(states), trial.controls])
    expected = inputs @ velocity_mean(layout, task.control_size, task.dt).T
    left = layout.targets(trial.states) - expected
    return sum(_output_evidence(part, inputs, left[:, a], a) for a in range(left.shape[1]))


def _output_evidence(part: LinearPart, inputs: Array, targets: Array, a: int) -> float:
    """Return the log evidence of one output, up to a constant, for the best b and s."""
    from scipy import optimize  # late: it takes as long as all else here

    scaled = part.scaled(inputs, a)
    values, vectors = np.linalg.eigh(scaled.gram)
    along, height = vectors.T @ targets, math.log(float(targets.std()) + 1e-9)

    def negative(logs: Array) -> float:
        variances = math.exp(2.0 * logs[0]) * np.maximum(values, 0.0) + math.exp(2.0 * logs[1])
        fit = 0.5 * float(np.sum(along**2 / variances + np.log(variances)))
        return fit + scaled.penalty(float(logs[0]))[0]

    bounds = [scaled.bounds, (height - 8.0, height + 2.0)]
    starts = [(scaled.expected, height - below) for below in (0.5, 2.5)]
    found = [optimize.minimize(negative, start, bounds=bounds).fun for start in starts]
    return -float(min(found))
