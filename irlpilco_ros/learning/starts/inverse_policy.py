"""What the robot must have been told for the demonstration, if the dynamics model is right.

Controls follow from the model's inverse, step by step; how to come back to the demonstration
follows from the model's slopes along it, by the linear-quadratic regulator. A policy fitted to both
is a start for policy search that is near a good optimum as soon as the model knows the way. The
commands of whoever demonstrated are not used, only the states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.inverse_step import inverse_step
from irlpilco_ros.learning.prediction.known_part import KnownPart
from irlpilco_ros.learning.prediction.model_input import extended_state
from irlpilco_ros.learning.starts.initial_policy import fit_policy, policy_limit
from irlpilco_ros.learning.task import Task

_NEIGHBOURS = 12  # states around each of the demonstration's that the policy is fitted at
_SPREAD = 0.1  # of them, relative to how far each state moves in the demonstration
_ROOT_CONTROL_WEIGHT = 3.0  # a control at its limit against a state as far off as it ever moves


@dataclass(frozen=True)
class Slopes:
    """A dynamics model along the demonstration, H steps.

    Attributes:
        controls: What makes the model go the demonstration's way, shape (H, F).
        by_state: d x[t+1] / d x[t], shape (H, D, D).
        by_control: d x[t+1] / d u[t], shape (H, D, F).
    """

    controls: Array
    by_state: Array
    by_control: Array


def inverse_policy(task: Task, settings: LearningSettings, model: DynamicsModel) -> Policy:
    """Return the policy that goes the demonstration's way and comes back to it."""
    limit = policy_limit(task, settings)
    slopes = slopes_along(task, model, limit)
    states = task.whole_reference_states()[:-1]
    size = np.maximum(states.std(axis=0), 1e-3)
    gains = regulator(slopes, size, limit)
    rng = np.random.default_rng(settings.seed)
    deviations = _SPREAD * size * rng.standard_normal((_NEIGHBOURS, *states.shape))
    deviations[0] = 0.0
    controls = slopes.controls - np.einsum("tfd,ntd->ntf", gains, deviations)
    shape = (-1, states.shape[1])
    return fit_policy(
        task,
        settings,
        np.tile(np.arange(len(states)), _NEIGHBOURS),
        (states + deviations).reshape(shape),
        np.clip(controls, -limit, limit).reshape(-1, len(limit)),
    )


def slopes_along(task: Task, model: DynamicsModel, limit: Array) -> Slopes:
    """Return the controls whose predicted steps come nearest to the demonstration's, and slopes.

    Minimises, at every step t, the squared distance between the predicted and the demonstrated
    change of the state, each state measured by how much it changes over the demonstration.

    Args:
        task: Its demonstration x[0..H].
        model: The dynamics model.
        limit: Largest absolute value of each control, shape (F,).
    """
    states, layout = task.whole_reference_states(), task.state_layout
    known_part = KnownPart.of(layout, len(limit))
    targets = layout.targets(task.reference_states())
    scale = np.maximum(targets.std(axis=0), 1e-9)
    known = list(layout.dynamics_inputs or ())
    controls, by_state, by_control = [], [], []
    for t, (state, target) in enumerate(zip(states[:-1], targets, strict=True)):
        certainly = Gaussian(state, np.zeros((len(state),) * 2))
        extended, _ = extended_state(certainly, layout)
        found = inverse_step(model, extended.mean[known], target, limit, t, scale)
        controls.append(found.control)
        moments = found.moments
        inner = moments.jacobian[:, : len(known)] @ extended.jacobian[known]
        following = known_part.matrix.copy()
        following[known_part.learned, : len(state)] += inner
        following[known_part.learned, len(state) :] += moments.jacobian[:, len(known) :]
        by_state.append(following[:, : len(state)])
        by_control.append(following[:, len(state) :])
    return Slopes(np.stack(controls), np.stack(by_state), np.stack(by_control))


def regulator(slopes: Slopes, size: Array, limit: Array) -> Array:
    """Return gains K[t] of u[t] - K[t] (x - x_E[t]), shape (H, F, D), by the Riccati recursion.

    Args:
        slopes: Along the demonstration.
        size: How far each state moves, which its deviations are measured by, shape (D,).
        limit: What controls are measured by, shape (F,).
    """
    state_weight = np.diag(1.0 / size**2)
    control_weight = _ROOT_CONTROL_WEIGHT**2 * np.diag(1.0 / limit**2)
    value, gains = state_weight, []
    for A, B in zip(slopes.by_state[::-1], slopes.by_control[::-1], strict=True):
        gain = np.linalg.solve(control_weight + B.T @ value @ B, B.T @ value @ A)
        closed = A - B @ gain
        value = state_weight + closed.T @ value @ closed + gain.T @ control_weight @ gain
        gains.append(gain)
    return np.stack(gains[::-1])
