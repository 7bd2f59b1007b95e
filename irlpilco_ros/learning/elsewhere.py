"""What trials elsewhere say of a robot here: the dynamics model that a policy is adapted in.

Trials of one motion are much alike. In the many dimensions of two arms, squared exponentials find
in them what goes along with what there; with the joints in other places they make as much of it,
and are wrong. What was identified of every joint holds there as well, and is all that is expected
there; what else there may be is doubt.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.learn import expected_dynamics, repeated_part
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.trial_data import condition_on_trials
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.state_layout import StateLayout
from irlpilco_ros.learning.task import Task

FARTHER = 5.0
"""How many times farther the model looks along the joints' positions than the evidence says.

Trials of one motion cannot tell whether a joint answers otherwise because it stands elsewhere or
because it moves otherwise; a velocity-controlled joint hardly does the former. Five times makes
predicted errors at places without a trial about as large as measured ones (2.7 and 3.8 mrad on two
robots where 2.9 was measured; 8.5 on the first if the evidence is believed, 1.8 at thirty)."""

_NOTHING = 1e-3
"""Standard deviation of what is left of the squared exponential, by the noise's."""


def model_elsewhere(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    tasks: Sequence[Task],
    hyperparameters: Hyperparameters,
) -> DynamicsModel:
    """Return the model of all trials, for a task that none of them may have been one of.

    With `prior_mean: identified` its mean is linear, and what repeats; without, it is all of the
    model's.

    Args:
        task: The motion, carried over, with the last commands in its state.
        settings: How to learn.
        trials: Every trial so far, in the order they were made.
        tasks: What each was a trial of.
        hyperparameters: Of the last iteration's model.
    """
    prior, linear = expected_dynamics(task, settings)
    condition = partial(
        condition_on_trials,
        trials,
        task.state_layout,
        prior_mean=prior,
        threads=settings.threads,
        linear=linear,
        repeated=(
            None if hyperparameters.log_repeated is None else repeated_part(task, trials, tasks)
        ),
        max_exact_points=settings.model_points,
    )
    if prior is None:
        return condition(hyperparameters)
    farther = condition(_looking_farther(hyperparameters, task.state_layout))
    if linear is None:
        return farther
    return farther.expecting(condition(_linear_alone(hyperparameters)))


def _linear_alone(hyperparameters: Hyperparameters) -> Hyperparameters:
    """Return these for a model of what is linear and what repeats, and noise.

    Its coefficients are near those of plain least squares (measured: predictions of a step at
    places without a trial were off by 1.3 mrad instead of 2.2, and by 3.0 instead of 4.9 on joints
    whose gains are not 1).
    """
    nothing = hyperparameters.log_noise + np.log(_NOTHING)
    return dataclasses.replace(hyperparameters, log_signal=nothing)


def _looking_farther(hyperparameters: Hyperparameters, layout: StateLayout) -> Hyperparameters:
    positions = np.array(layout.dynamics_inputs or ()) < layout.measured_size // 2
    lengthscales: Array = hyperparameters.log_lengthscales.copy()
    lengthscales[:, : len(positions)] += np.log(FARTHER) * positions
    return dataclasses.replace(hyperparameters, log_lengthscales=lengthscales)
