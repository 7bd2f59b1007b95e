"""From recorded trials to a dynamics model: what goes in, and what is to be predicted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from irlpilco_ros.learning.gp.hyperprior import HyperpriorName
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.state_layout import StateLayout

_COLD_EVALUATIONS, _WARM_EVALUATIONS = 300, 40
"""Of the evidence, for each output: a warm start goes on where the last iteration stopped."""


def train_on_trials(
    trials: Sequence[Rollout],
    layout: StateLayout,
    prior_mean: Array | None,
    warm_start: Hyperparameters | None,
    threads: int,
    progress: Callable[[float], None] | None = None,
    hyperprior: HyperpriorName = "pilco",
) -> DynamicsModel:
    """Return the dynamics model of all trials (thesis (2.17)), by evidence maximisation.

    Args:
        trials: With their controls, in the order they were made.
        layout: What the model sees of the state, and what it predicts.
        prior_mean: A of the linear prior mean, shape (E, P); None for zero.
        warm_start: Hyperparameters to start from; None for the scales of the data.
        threads: Has no influence on the result.
        progress: Told the fraction that is done.
        hyperprior: On the hyperparameters, before any data.
    """
    views = [layout.dynamics_view(trial.states[:-1]) for trial in trials]
    pairs = [np.hstack([view, trial.controls]) for view, trial in zip(views, trials, strict=True)]
    return DynamicsModel.train(
        np.vstack(pairs),
        np.vstack([layout.targets(trial.states) for trial in trials]),
        prior_mean=prior_mean,
        warm_start=warm_start,
        threads=threads,
        progress=progress,
        hyperprior=hyperprior,
        max_evaluations=_COLD_EVALUATIONS if warm_start is None else _WARM_EVALUATIONS,
    )


def seen_prior(prior: Array, layout: StateLayout) -> Array:
    """Return a prior mean of the state and the controls, for what a dynamics model sees of them.

    Sine and cosine of an angle say nothing linear about a change: their columns are zero, and that
    of an angle that is not seen itself is left out.

    Args:
        prior: A for the inputs [state, controls] and increments of all states, shape (D, D + F).
        layout: What the model sees, P of the D states and their sines and cosines, and what it
            predicts.

    Returns:
        A of shape (D, P + F).
    """
    size = layout.state_size
    of_state = prior[:, :size] + np.diag(1.0 - layout.difference_mask)
    extended = np.hstack([of_state, np.zeros((size, 2 * len(layout.angles or ())))])
    return np.hstack([extended[:, list(layout.dynamics_inputs or ())], prior[:, size:]])
