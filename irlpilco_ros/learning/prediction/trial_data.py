"""From recorded trials to a dynamics model: what goes in, and what is to be predicted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gp.hyperprior import HyperpriorName
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.gp.repeated_part import RepeatedPart
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.dynamics_model import MAX_EXACT_POINTS, DynamicsModel
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.state_layout import StateLayout

_COLD_EVALUATIONS, _WARM_EVALUATIONS = 300, 40
"""Of the evidence, for each output: a warm start goes on where the last iteration stopped."""

_FEW_TRIALS = 3
"""Up to these a cold search beside the warm one often finds more evidence; later none did."""


@dataclass(frozen=True)
class Steps:
    """Steps of a robot that are no trial's.

    Attributes:
        inputs: What the dynamics model sees of the states, and the controls, shape (m, P).
        targets: What it is to predict, shape (m, E).
    """

    inputs: Array
    targets: Array


def train_on_trials(
    trials: Sequence[Rollout],
    layout: StateLayout,
    prior_mean: Array | None,
    warm_start: Hyperparameters | None,
    threads: int,
    progress: Callable[[float], None] | None = None,
    hyperprior: HyperpriorName = "pilco",
    linear: LinearPart | None = None,
    repeated: RepeatedPart | None = None,
    max_exact_points: int = MAX_EXACT_POINTS,
    more: Steps | None = None,
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
        linear: Part of the dynamics that is linear, with coefficients to be identified.
        repeated: Of `what_repeats`, if that is to be identified.
        max_exact_points: As in `DynamicsModel.train`.
        more: Steps besides those of the trials, where nothing repeats.
    """
    inputs, targets = _pairs(trials, layout)
    if more is not None:
        inputs, targets = np.vstack([inputs, more.inputs]), np.vstack([targets, more.targets])
    return DynamicsModel.train(
        inputs,
        targets,
        prior_mean=prior_mean,
        warm_start=warm_start,
        threads=threads,
        progress=progress,
        hyperprior=hyperprior,
        max_evaluations=_COLD_EVALUATIONS if warm_start is None else _WARM_EVALUATIONS,
        linear=linear,
        repeated=repeated,
        max_exact_points=max_exact_points,
        cold_search=len(trials) <= _FEW_TRIALS,
    )


def condition_on_trials(
    trials: Sequence[Rollout],
    layout: StateLayout,
    hyperparameters: Hyperparameters,
    prior_mean: Array | None,
    threads: int,
    linear: LinearPart | None = None,
    repeated: RepeatedPart | None = None,
    max_exact_points: int = MAX_EXACT_POINTS,
) -> DynamicsModel:
    """Return the dynamics model of all trials with hyperparameters that are known.

    Other arguments are those of `train_on_trials`.
    """
    return DynamicsModel.condition(
        *_pairs(trials, layout),
        hyperparameters,
        prior_mean,
        threads,
        max_exact_points,
        linear,
        repeated,
    )


def _pairs(trials: Sequence[Rollout], layout: StateLayout) -> tuple[Array, Array]:
    """Return what goes in (n, P), and what is to be predicted (n, E)."""
    states = [layout.whole_states(trial.states, trial.controls)[:-1] for trial in trials]
    inputs = [
        np.hstack([layout.dynamics_view(before), trial.controls])
        for before, trial in zip(states, trials, strict=True)
    ]
    return np.vstack(inputs), np.vstack([layout.targets(trial.states) for trial in trials])


def what_repeats(
    trials: Sequence[Rollout], speeds: Sequence[float], speed: float, horizon: int
) -> RepeatedPart:
    """Return what is the same at a step of every trial: of every one at the same speed.

    Args:
        trials: As in `train_on_trials`.
        speeds: `Task.speed` of each of them.
        speed: The one that predictions are for; its steps are the first ones.
        horizon: Number of its steps.
    """
    begins, end = {speed: 0}, horizon
    for trial, own in zip(trials, speeds, strict=True):
        if own not in begins:
            begins[own], end = end, end + trial.steps
    steps = [begins[own] + np.arange(each.steps) for each, own in zip(trials, speeds, strict=True)]
    return RepeatedPart(np.concatenate(steps), end)
