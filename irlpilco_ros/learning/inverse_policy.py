"""What the robot must have been told for the demonstration, if the dynamics model is right."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.dynamics_model import DynamicsModel
from irlpilco_ros.learning.gaussian import Array
from irlpilco_ros.learning.initial_policy import fitted_policy, policy_limit
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.task import Task

_STEPS = 8  # of Gauss-Newton; controls enter most dynamics almost linearly
_DAMPING = 1e-3  # relative: keeps a control that the model knows no effect of near zero


def inverse_policy(task: Task, settings: LearningSettings, model: DynamicsModel) -> Policy:
    """Return the policy that gives `inverse_controls` along the demonstration.

    Commands of whoever demonstrated are not used, only the states.
    """
    return fitted_policy(
        task, settings, inverse_controls(task, model, policy_limit(task, settings))
    )


def inverse_controls(task: Task, model: DynamicsModel, limit: Array) -> Array:
    """Return the controls (H, F) whose predicted steps come nearest to the demonstration's.

    Minimises, at every step t, the squared distance between the predicted and the demonstrated
    change of the state, each state measured by how much it changes over the demonstration, with
    the model's expected Jacobian by the control.

    Args:
        task: Its demonstration x[0..H].
        model: The dynamics model.
        limit: Largest absolute value of each control, shape (F,).
    """
    states, layout = task.reference_states(), task.state_layout
    views, targets = layout.dynamics_view(states[:-1]), layout.targets(states)
    scale = np.maximum(targets.std(axis=0), 1e-9)
    certain = np.zeros((views.shape[1] + len(limit),) * 2)
    controls = np.zeros((len(targets), len(limit)))
    for t, (view, target) in enumerate(zip(views, targets, strict=True)):
        for _ in range(_STEPS):
            seen = np.concatenate([view, controls[t]])
            moments, _ = model.predict(seen, certain, gradient=False)
            slope = moments.jacobian[:, len(view) :] / scale[:, None] * limit
            missing = (target - moments.mean) / scale
            curvature = slope.T @ slope
            curvature += _DAMPING * (np.trace(curvature) + 1e-9) * np.eye(len(limit))
            step = limit * np.linalg.solve(curvature, slope.T @ missing)
            controls[t] = np.clip(controls[t] + step, -limit, limit)
    return controls
