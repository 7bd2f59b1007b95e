"""The dynamics model asked backwards: which control makes a step that was seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Moments
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel

_STEPS = 8  # of Gauss-Newton; controls enter most dynamics almost linearly
_DAMPING = 1e-3  # relative: keeps a control that the model knows no effect of near zero


@dataclass(frozen=True)
class InverseStep:
    """The control that explains a step best.

    Attributes:
        control: Shape (F,), within the limit.
        error: What is left of the target, by the scale, shape (E,).
        moments: What the model predicts there.
    """

    control: Array
    error: Array
    moments: Moments


def inverse_step(
    model: DynamicsModel,
    known: Array,
    target: Array,
    limit: Array,
    step: int | None,
    scale: Array | None = None,
) -> InverseStep:
    """Return the control whose predicted step comes nearest to a target, by Gauss-Newton.

    Args:
        model: The dynamics model.
        known: What the model sees of the state, shape (P - F,).
        target: What it is to predict, shape (E,).
        limit: Largest absolute value of each control, shape (F,).
        step: Of a trial, for what repeats there.
        scale: What errors are measured by, shape (E,); None for the standard deviations of what the
            model predicts to be measured, which makes the control the most likely one.
    """
    certain = np.zeros((len(known) + len(limit),) * 2)
    control = np.zeros(len(limit))
    for _ in range(_STEPS):
        seen = np.concatenate([known, control])
        moments, _ = model.predict(seen, certain, gradient=False, step=step)
        size = _deviations(model, moments) if scale is None else scale
        slope = moments.jacobian[:, len(known) :] / size[:, None] * limit
        missing = (target - moments.mean) / size
        curvature = slope.T @ slope
        curvature += _DAMPING * (np.trace(curvature) + 1e-9) * np.eye(len(limit))
        move = limit * np.linalg.solve(curvature, slope.T @ missing)
        control = np.clip(control + move, -limit, limit)
    return InverseStep(control, missing, moments)


def _deviations(model: DynamicsModel, moments: Moments) -> Array:
    variances = np.maximum(np.diag(moments.covariance), 0.0)
    deviations: Array = np.sqrt(variances + model.hyperparameters.noise_variance)
    return deviations
