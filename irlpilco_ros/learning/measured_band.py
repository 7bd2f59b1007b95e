"""Where the measurements of the next trial will lie, if the past is a guide.

A model says how uncertain its predictions are, but it takes its hyperparameters as known and its
outputs as independent, so that it promises too much at first and too little later. How the trial
before lay in its own band corrects that: deviations are scaled so that the band of two would have
held what it should of that trial (as calibrated regression does: Kuleshov, Fenner & Ermon 2018).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task

_HELD, _HELD_LESS = 0.975, 0.13
"""Of the trial of iteration k its band is made to hold 0.975 - 0.13 / k: the next one lies closer,
and by more the less was known before (see docs/results.md for what the bands hold then)."""

_SECOND = 1.1
"""How much wider than the model says the band of k = 2 is, before any trial tells."""

_SMALLEST = 0.1

_FIRST = 2
"""The first iteration whose trial tells: the model of a single trial knows nothing that repeats."""


def measured_deviations(
    task: Task, covariances: Array, previous: Iteration | None, trials: Sequence[Rollout]
) -> Array:
    """Return standard deviations of what will be measured, shape (H + 1, D).

    Args:
        task: Tells the noise of the sensors.
        covariances: Predicted ones, shape (H + 1, D, D).
        previous: The iteration before, with its prediction if that is told; None for none.
        trials: Every trial so far. If that of its policy is not among them, for the object moved
            before, what corrected the iteration before corrects this one.
    """
    return _scale(task, previous, trials) * _uncorrected(task, covariances)


def _scale(task: Task, previous: Iteration | None, trials: Sequence[Rollout]) -> float:
    if previous is None or not previous.predicted_means.size:
        return 1.0  # its prediction is not told
    if previous.index < _FIRST:
        return _SECOND
    uncorrected = _uncorrected(task, previous.predicted_covariances)
    positions = task.state_size // 2  # what is shown and watched
    if previous.index >= len(trials):
        corrected = previous.predicted_deviations / uncorrected
        return max(float(np.median(corrected[1:, :positions])), _SMALLEST)
    off = trials[previous.index].states - previous.predicted_means
    angles = list(task.state_layout.angles)
    off[:, angles] = np.arctan2(np.sin(off[:, angles]), np.cos(off[:, angles]))
    ratios = np.abs(off) / uncorrected
    held = _HELD - _HELD_LESS / previous.index
    return max(float(np.quantile(ratios[1:, :positions], held)) / 2.0, _SMALLEST)


def _uncorrected(task: Task, covariances: Array) -> Array:
    variances = np.maximum(np.diagonal(covariances, axis1=1, axis2=2), 0.0)
    deviations: Array = np.sqrt(variances + task.noise**2)
    return deviations
