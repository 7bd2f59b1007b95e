"""What the demonstrations say of the dynamics, though nobody recorded their commands.

A step that was shown is a step of the robot by some command, and the dynamics model of the trials
tells which one explains it best. With that the step counts as data: the model comes to know the
way before a trial has gone it, the next trial follows it further, and what was wrongly inferred
is inferred anew with that trial. (Behavioural cloning from observation infers commands likewise,
Torabi et al., IJCAI 2018, to clone them.)
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.inverse_step import inverse_step
from irlpilco_ros.learning.prediction.trial_data import Steps
from irlpilco_ros.learning.task import Task

ROUNDS = 2
"""How often commands are inferred: the first ones tell more about the others.

On eight seeds of the cart-pole the pole was first held in iteration 2.9 in the mean with one round,
2.5 with two and 2.4 with three; 3.5 if only commands counted that were certain to a tenth of their
limit, and 4.6 without any."""

_UNLIKELY = 3.0
"""Mean square of a step's errors, by their predicted deviations, from which no command makes it."""


def with_inferred_steps(
    task: Task,
    limit: Array,
    model: DynamicsModel,
    train: Callable[[Steps, Hyperparameters], DynamicsModel],
) -> DynamicsModel:
    """Return the dynamics model of the trials and of what was shown.

    Args:
        task: Its demonstrations; only their states count.
        limit: Largest absolute value of each control, shape (F,).
        model: Of the trials alone.
        train: Returns the model of the trials and of more steps, trained from such hyperparameters.

    Returns:
        The model, with a note if no command makes most of the demonstrations' steps.
    """
    shown = sum(demonstration.steps for demonstration in task.demonstrations)
    for _ in range(ROUNDS):
        steps = inferred_steps(task, limit, model)
        model = train(steps, model.hyperparameters)
    if 2 * len(steps.inputs) >= shown:
        return model
    note = (
        f"infer_commands: a command that makes it was found for {len(steps.inputs)} of {shown} "
        "steps of the demonstrations; if that does not change with more trials, the robot cannot "
        "have been shown them under its own dynamics"
    )
    return dataclasses.replace(model, notes=(*model.notes, note))


def inferred_steps(task: Task, limit: Array, model: DynamicsModel) -> Steps:
    """Return the steps of the demonstrations, each with the command that the model takes it for.

    Those that are unlikely by any command are left out.
    """
    layout = task.state_layout
    inputs, targets = np.empty((0, len(model.inputs[0]))), np.empty((0, len(model.targets[0])))
    for demonstration in task.demonstrations:
        view = layout.dynamics_view(demonstration.states[:-1])
        goals = layout.targets(demonstration.states)
        told = [
            inverse_step(model, known, goal, limit, t)
            for t, (known, goal) in enumerate(zip(view, goals, strict=True))
        ]
        likely = [np.mean(step.error**2) < _UNLIKELY for step in told]
        controls = np.stack([step.control for step in told])
        inputs = np.vstack([inputs, np.hstack([view, controls])[likely]])
        targets = np.vstack([targets, goals[likely]])
    return Steps(inputs, targets)
