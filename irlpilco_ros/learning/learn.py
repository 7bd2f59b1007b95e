"""One pass of IRL/PILCO (thesis Algorithm 3) or PILCO (Algorithm 2): trials in, next policy out."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Callable, Sequence
from typing import cast

import numpy as np

from irlpilco_ros.learning import imitation
from irlpilco_ros.learning.conclusion import concluded
from irlpilco_ros.learning.costs import Cost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.hyperprior import HyperpriorName
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.gp.repeated_part import RepeatedPart
from irlpilco_ros.learning.imitation import Imitation
from irlpilco_ros.learning.inferred_steps import ROUNDS, with_inferred_steps
from irlpilco_ros.learning.iteration import Iteration, Progress
from irlpilco_ros.learning.judgement import cost_of_trial
from irlpilco_ros.learning.lag import with_known_history
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.threads import one_blas_thread
from irlpilco_ros.learning.pace import at_moments_of
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.prediction.prior_mean import servo_part, velocity_mean
from irlpilco_ros.learning.prediction.trial_data import Steps, train_on_trials, what_repeats
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.search.beginning_first import search_beginning_first, total_evaluations
from irlpilco_ros.learning.search.horizon_curriculum import HorizonCurriculum
from irlpilco_ros.learning.search.policy_search import SearchResult, search_policy
from irlpilco_ros.learning.search.second_start import most_evaluations, search_with_second_start
from irlpilco_ros.learning.second_search import search_twice_if_needed
from irlpilco_ros.learning.starts.initial_policy import (
    initial_policy,
    policy_limit,
    random_policy,
    zero_policy,
)
from irlpilco_ros.learning.starts.inverse_policy import inverse_policy
from irlpilco_ros.learning.starts.random_start import random_start
from irlpilco_ros.learning.task import Task
from irlpilco_ros.learning.weight_rules import WEIGHT_RULES


def learn(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    previous: Iteration | None = None,
    progress: Callable[[Progress], None] | None = None,
    best: Iteration | None = None,
    tasks: Sequence[Task] | None = None,
) -> Iteration:
    """Do one pass: cost weights if there is a demonstration, dynamics model, policy search.

    Deterministic: the same arguments give the same bits, whatever `settings.threads` is.

    Args:
        task: What is to be learned.
        settings: How.
        trials: Every trial so far, in the order they were made, with their controls.
        previous: The iteration before, for warm starts; None for the first.
        progress: Told where learning stands; whatever it raises cancels learning.
        best: The iteration whose trial was the best so far, to start again from its policy if the
            search comes out much worse than before; None for the one before.
        tasks: What each trial was a trial of, if not all of this very task: the same motion at
            other places, or at other speeds. All of them tell of the robot, and by their
            deviations of the weights.

    Raises:
        InvalidSettingError: if there is no trial, or one that does not fit the task.
        NumericalError: if no finite prediction can be made.
    """
    check_trials(task, trials, tasks)
    settings = with_known_history(task, settings, trials)
    here = trials_of(task, trials, tasks)
    weighed = weigh(task, settings, trials, tasks)
    task = task.remembering(settings.command_history)
    if previous is not None and previous.index == 0:
        previous = None  # it has learned nothing that one could start from
    report = _Reporter(progress, task, settings)
    with one_blas_thread():
        weights, margin = weighed
        began = time.perf_counter()
        model = _train_model(task, settings, trials, tasks, previous, report)
        trained = time.perf_counter()
        objective = expected_cost(task, settings, model, here, weights)
        wide = objective.with_wider_start(settings.start_widening)
        found, notes = search_twice_if_needed(
            lambda starts: _search(task, settings, wide, weights, starts, report),
            _starting_policies(task, settings, model, objective.start, previous),
            previous,
            best,
            lambda index: cost_of_trial(objective.cost, trials[index]),
        )
        iteration = concluded(task, trials, objective, found, weighed, previous)
        searched = time.perf_counter()
    return dataclasses.replace(
        iteration,
        hyperparameters=model.hyperparameters,
        model_seconds=trained - began,
        policy_seconds=searched - trained,
        learned=margin <= settings.margin_tolerance,
        notes=(*model.notes, *notes),
    )


def trials_of(
    task: Task, trials: Sequence[Rollout], tasks: Sequence[Task] | None
) -> Sequence[Rollout]:
    """Return those of the trials that were trials of this very task; arguments as `learn`."""
    if tasks is None:
        return trials
    return [trial for trial, own in zip(trials, tasks, strict=True) if own is task]


def weigh(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    tasks: Sequence[Task] | None = None,
) -> tuple[Array, float]:
    """Return cost weights (k,) and margin from all trials so far (thesis (4.5)-(4.6)).

    Features of different units are made comparable by `task.feature_scale` first. Weights are
    lifted to `settings.weight_floor` of the largest one: pure max-margin all but ignores what
    the last trial did well, and the next one then does it badly. Where a cost is given there are
    no weights, and the margin is NaN.
    """
    if task.cost is not None:
        return np.empty(0), math.nan
    way = _way(settings, settings.imitation)
    owns = tasks or [task] * len(trials)
    deviations = [
        way.deviation(_differences(task, own, trial))
        for own, trial in zip(owns, trials, strict=True)
    ]
    expert = [_own_deviation(task, own, way) for own in owns]
    rule = WEIGHT_RULES[settings.weight_rule]
    weights, margin = rule(np.stack(deviations), np.stack(expert))
    lifted = np.maximum(weights, settings.weight_floor * weights.max())
    return lifted / np.linalg.norm(lifted), margin


def _own_deviation(task: Task, own: Task, way: Imitation) -> Array:
    """Return psi_E (k,), the mean of the deviations of the demonstrations from their mean."""
    shown = [way.deviation(_differences(task, own, each)) for each in own.demonstrations]
    deviation: Array = np.mean(shown, axis=0)
    return deviation


def _differences(task: Task, own: Task, trial: Rollout) -> Array:
    """Return what a trial's features were off, by their typical size, at the task's moments."""
    off = (own.feature_map.of(trial.states) - own.reference_features()) / own.scale
    return at_moments_of(task, own, off)


def expected_cost(
    task: Task,
    settings: LearningSettings,
    model: DynamicsModel,
    trials: Sequence[Rollout],
    weights: Array,
) -> Objective:
    """Return what policy search minimises, as a function of the policy."""
    noise = task.state_layout.policy_noise(task.noise) if settings.sensor_noise else None
    return Objective(
        model=model,
        start=start_state(task, trials),
        horizon=task.horizon,
        layout=task.state_layout,
        cost=_cost(task, settings, settings.imitation, weights),
        approximation=cast(CovarianceApproximation, settings.covariance_approximation),
        noise=noise,
    )


def start_state(task: Task, trials: Sequence[Rollout]) -> Gaussian:
    """Return where trials start: where they did so far, spread as much as they are known to.

    A start that the task knows is taken as it is; before the first trial, that of what was shown,
    at rest. Nothing has been commanded before.
    """
    measured = task.start or _measured_start(task, trials)
    added = task.state_layout.state_size - len(measured.mean)
    return Gaussian(np.pad(measured.mean, (0, added)), np.pad(measured.covariance, (0, added)))


def _measured_start(task: Task, trials: Sequence[Rollout]) -> Gaussian:
    if not trials:
        start = task.reference_states()[0].copy()
        start[len(start) // 2 :] = 0.0
        return Gaussian(start, np.diag(np.maximum(task.noise, task.start_spread) ** 2))
    starts = np.stack([trial.states[0] for trial in trials])
    angles = list(task.state_layout.angles)
    # A joint that stands at pi may be read as -pi; that is no other place.
    turns = np.rint((starts[:, angles] - starts[0, angles]) / (2.0 * np.pi))
    starts[:, angles] -= 2.0 * np.pi * turns
    variances = np.maximum(starts.var(axis=0) + task.noise**2, task.start_spread**2)
    return Gaussian(starts.mean(axis=0), np.diag(variances))


def _way(settings: LearningSettings, name: str) -> Imitation:
    way = imitation.REGISTRY.get(name)
    return way(settings.options_of(way), settings.discount)


def _cost(task: Task, settings: LearningSettings, way: str, weights: Array) -> Cost:
    """Return the cost that is given, or that of a way of imitating."""
    return task.cost or _way(settings, way).cost(task, weights / task.scale**2)


def expected_dynamics(
    task: Task, settings: LearningSettings
) -> tuple[Array | None, LinearPart | None]:
    """Return prior mean (E, P) and linear part of the dynamics model, as far as it has them."""
    layout, prior, linear = task.state_layout, None, None
    if settings.prior_mean != "zero":
        prior = velocity_mean(layout, task.control_size, task.dt)
    if settings.prior_mean == "identified":
        linear = servo_part(layout, task.control_size, task.dt)
    return prior, linear


def _train_model(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    tasks: Sequence[Task] | None,
    previous: Iteration | None,
    report: _Reporter,
) -> DynamicsModel:
    prior, linear = expected_dynamics(task, settings)
    infer = settings.infer_commands and bool(task.demonstrations)
    begun = itertools.count()

    def train(more: Steps | None, known: Hyperparameters | None) -> DynamicsModel:
        report.training(next(begun), 1 + ROUNDS if infer else 1)
        return train_on_trials(
            trials,
            task.state_layout,
            prior,
            known,
            settings.threads,
            report.model,
            cast(HyperpriorName, settings.hyperprior),
            linear,
            repeated_part(task, trials, tasks) if settings.repeating_errors else None,
            settings.model_points,
            more,
        )

    model = train(None, previous.hyperparameters if previous is not None else None)
    if infer:
        return with_inferred_steps(task, policy_limit(task, settings), model, train)
    return model


def repeated_part(
    task: Task, trials: Sequence[Rollout], tasks: Sequence[Task] | None
) -> RepeatedPart:
    """Return what repeats at the same step of the trials; arguments as `learn`."""
    speeds = [own.speed for own in tasks or [task] * len(trials)]
    return what_repeats(trials, speeds, task.speed, task.horizon)


def _starting_policies(
    task: Task,
    settings: LearningSettings,
    model: DynamicsModel,
    start: Gaussian,
    previous: Iteration | None,
) -> list[Policy]:
    if task.cost is not None:  # as in PILCO
        if previous is None:
            return [random_start(task, settings, start)]
        if task.region is None:
            return [previous.policy]
        return [previous.policy, random_start(task, settings, task.region, previous.index)]
    zero = zero_policy(task, settings)
    first = initial_policy(task, settings)
    if not first.searchable:  # random controls
        first = zero
    policies: dict[str, Callable[[], Policy]] = {
        "last": lambda: previous.policy if previous is not None else first,
        "zero": lambda: zero,
        "initial": lambda: first,
        "random": lambda: random_policy(zero, settings.seed + 1, settings.initial_scale),
        "inverse": lambda: inverse_policy(task, settings, model),
    }
    return [policies[name]() for name in dict.fromkeys(settings.starts)]


def _search(
    task: Task,
    settings: LearningSettings,
    objective: Objective,
    weights: Array,
    starts: Sequence[Policy],
    report: _Reporter,
) -> SearchResult:
    """Return the best policy found from the starts."""
    if task.cost is not None:
        how = settings.optimiser, settings.evaluations, report.policy
        if len(starts) > 1:
            return search_with_second_start(objective, starts, *how)
        return search_beginning_first(objective, starts[0], *how)
    way = _way(settings, settings.imitation)
    stepwise = way.stepwise_cost(task, weights / task.scale**2)
    if stepwise is not None and settings.horizon_stages > 1:
        curriculum = HorizonCurriculum(
            objective,
            stepwise,
            settings.optimiser,
            settings.horizon_stages,
            settings.screening_evaluations,
            settings.evaluations,
        )
        return curriculum.search(starts, report.policy)
    objectives = [objective]
    if way.warm_up:
        easier = _cost(task, settings, way.warm_up, weights)
        objectives.insert(0, dataclasses.replace(objective, cost=easier))
    for number, current in enumerate(objectives):
        report.search(number, len(objectives))
        found = search_policy(
            current,
            starts,
            settings.optimiser,
            settings.evaluations,
            report.policy,
            settings.screening_evaluations,
        )
        starts = [found.policy]
    return found


def check_trials(
    task: Task, trials: Sequence[Rollout], tasks: Sequence[Task] | None = None
) -> None:
    """Check that there are trials, and that each is of the size of what it was a trial of.

    Arguments are those of `learn`.

    Raises:
        InvalidSettingError: says what is wrong with which.
    """
    if not trials:
        raise InvalidSettingError("learning needs at least one trial; record one first")
    for number, (trial, own) in enumerate(zip(trials, tasks or [task] * len(trials), strict=True)):
        wanted = (own.horizon + 1, task.state_size), (own.horizon, task.control_size)
        if (trial.states.shape, trial.controls.shape) != wanted:
            raise InvalidSettingError(
                f"trial {number} has states {trial.states.shape} and controls "
                f"{trial.controls.shape}; the task needs {wanted[0]} and {wanted[1]}"
            )
        if not trial.commanded:
            raise InvalidSettingError(
                f"trial {number} has no controls (all NaN): a dynamics model cannot learn from it"
            )


class _Reporter:
    """Turns the stages' own progress into that of the whole iteration."""

    MODEL_PART = 0.3

    def __init__(
        self,
        progress: Callable[[Progress], None] | None,
        task: Task,
        settings: LearningSettings,
    ) -> None:
        self._progress = progress
        if task.cost is not None:
            most = total_evaluations if task.region is None else most_evaluations
            self._evaluations = most(settings.evaluations)
        else:
            tries = len(dict.fromkeys(settings.starts)) + settings.horizon_stages - 2
            self._evaluations = settings.evaluations + settings.screening_evaluations * tries
        self._training, self._trainings = 0, 1
        self._search, self._searches = 0, 1
        self._reached = 0.0

    def training(self, number: int, trainings: int) -> None:
        """The model is trained, once of several times."""
        self._training, self._trainings = number, trainings

    def search(self, number: int, searches: int) -> None:
        """One search begins, of several that follow each other."""
        self._search, self._searches = number, searches

    def model(self, fraction: float) -> None:
        if self._progress is not None:
            done = self.MODEL_PART * (self._training + fraction) / self._trainings
            self._progress(Progress("model", done, math.nan, 0, "training the model"))

    def policy(self, cost: float, evaluations: int) -> None:
        if self._progress is None:
            return
        done = (self._search + min(1.0, evaluations / self._evaluations)) / self._searches
        # A second search from the best policy finds everything done already.
        self._reached = max(self._reached, self.MODEL_PART + (1.0 - self.MODEL_PART) * done)
        message = f"searching the policy: cost {cost:.4g} after {evaluations} evaluations"
        self._progress(Progress("policy", self._reached, cost, evaluations, message))
