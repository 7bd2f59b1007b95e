"""IRL/PILCO (thesis Algorithm 3) as pure functions: recorded trials in, next policy out."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from irlpilco_ros.learning.costs import Cost, FeatureExpectations, FeatureMatching, TrajectoryKl
from irlpilco_ros.learning.costs.base import discounts
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.dynamics_model import DynamicsModel
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.gp.trial_data import train_on_trials
from irlpilco_ros.learning.iteration import Errors, Iteration, Progress
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.threads import one_blas_thread
from irlpilco_ros.learning.policies import OpenLoopPolicy, Policy
from irlpilco_ros.learning.policies.initial_policy import initial_policy, random_policy, zero_policy
from irlpilco_ros.learning.policies.inverse_policy import inverse_policy
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.search.policy_search import SearchResult, search_policy
from irlpilco_ros.learning.search.staged_search import StagedSearch
from irlpilco_ros.learning.task import Task
from irlpilco_ros.learning.weight_rules import WEIGHT_RULES

__all__ = [
    "Errors",
    "Iteration",
    "LearningSettings",
    "Progress",
    "Rollout",
    "Task",
    "initial_policy",
    "judge",
    "learn",
    "open_loop_policy",
]


def open_loop_policy(task: Task) -> OpenLoopPolicy:
    """Return the replay of the demonstration's own speeds: the baseline of all learning."""
    controls = np.clip(task.demonstrated_controls(), -task.control_limit, task.control_limit)
    return OpenLoopPolicy(controls, task.control_limit, task.state_size)


def learn(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    previous: Iteration | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Iteration:
    """Do one pass of thesis Algorithm 3: weights, dynamics model, policy search.

    Deterministic: the same arguments give the same bits, whatever `settings.threads` is.

    Args:
        task: What is to be learned.
        settings: How.
        trials: Every trial so far, in the order they were made, with their controls.
        previous: The iteration before, for warm starts; None for the first.
        progress: Told where learning stands; whatever it raises cancels learning.

    Raises:
        InvalidSettingError: if there is no trial, or one that does not fit the task.
        NumericalError: if no finite prediction can be made.
    """
    _check_trials(task, trials)
    report = _Reporter(progress, settings)
    with one_blas_thread():
        weights, margin = weigh(task, settings, trials)
        began = time.perf_counter()
        model = _train_model(task, settings, trials, previous, report)
        trained = time.perf_counter()
        objective = imitation_objective(task, settings, model, trials, weights)
        starts = _starting_policies(task, settings, model, previous)
        found = _search_policy(task, settings, objective, weights, starts, report)
        prediction = objective.evaluate(found.policy, gradient=False).trajectory
        searched = time.perf_counter()
    return Iteration(
        index=len(trials),
        policy=found.policy,
        hyperparameters=model.hyperparameters,
        weights=weights,
        margin=margin,
        cost=found.cost,
        predicted_means=prediction.means,
        predicted_covariances=prediction.covariances,
        evaluations=found.evaluations,
        model_seconds=trained - began,
        policy_seconds=searched - trained,
        learned=margin <= settings.margin_tolerance,
        notes=model.notes,
    )


def weigh(task: Task, settings: LearningSettings, trials: Sequence[Rollout]) -> tuple[Array, float]:
    """Return cost weights (k,) and margin from all trials so far (thesis (4.5)-(4.6)).

    Features of different units are made comparable by `task.feature_scale` first. Weights are
    lifted to `settings.weight_floor` of the largest one: pure max-margin all but ignores what
    the last trial did well, and the next one then does it badly.
    """
    factors = discounts(settings.discount, task.horizon)
    reference = task.reference_features()
    deviations = []
    for trial in trials:
        difference = (task.feature_map.of(trial.states) - reference) / task.scale
        if settings.imitation == "feature_expectations":
            deviations.append((factors @ difference) ** 2)
        else:
            deviations.append(factors @ difference**2)
    weights, margin = WEIGHT_RULES[settings.weight_rule](np.stack(deviations))
    lifted = np.maximum(weights, settings.weight_floor * weights.max())
    return lifted / np.linalg.norm(lifted), margin


def imitation_objective(
    task: Task,
    settings: LearningSettings,
    model: DynamicsModel,
    trials: Sequence[Rollout],
    weights: Array,
) -> Objective:
    """Return the expected cost of imitation, as a function of the policy."""
    return Objective(
        model=model,
        start=start_state(task, trials),
        horizon=task.horizon,
        layout=task.state_layout,
        cost=_imitation_cost(task, settings, weights / task.scale**2),
        approximation="exact" if settings.covariance_approximation == "exact" else "first_order",
    )


def start_state(task: Task, trials: Sequence[Rollout]) -> Gaussian:
    """Return where trials start: where they did so far, spread as much as they are known to."""
    starts = np.stack([trial.states[0] for trial in trials])
    variances = np.maximum(starts.var(axis=0) + task.noise**2, task.start_spread**2)
    return Gaussian(starts.mean(axis=0), np.diag(variances))


def _imitation_cost(task: Task, settings: LearningSettings, weights: Array) -> Cost:
    features, reference = task.feature_map, task.reference_features()
    if settings.imitation == "feature_matching":
        return _feature_matching(task, settings, weights)
    if settings.imitation == "feature_expectations":
        return FeatureExpectations(features, reference, weights, settings.discount)
    return TrajectoryKl(
        features,
        reference,
        task.reference_covariances(),
        task.feature_noise(),
        settings.discount,
    )


def _feature_matching(task: Task, settings: LearningSettings, weights: Array) -> FeatureMatching:
    return FeatureMatching(
        task.feature_map,
        task.reference_features(),
        weights,
        settings.variance_weight,
        settings.discount,
    )


def _train_model(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    previous: Iteration | None,
    report: _Reporter,
) -> DynamicsModel:
    prior = None
    if settings.prior_mean == "velocity":
        prior = velocity_prior(task.control_size, task.dt)
    return train_on_trials(
        trials,
        task.state_layout,
        prior,
        previous.hyperparameters if previous is not None else None,
        settings.threads,
        report.model,
        "pilco" if settings.hyperprior == "pilco" else "dimension_scaled",
    )


def _starting_policies(
    task: Task, settings: LearningSettings, model: DynamicsModel, previous: Iteration | None
) -> list[Policy]:
    zero = zero_policy(task, settings)
    first = initial_policy(task, settings)
    if first.kind != zero.kind:  # random controls: nothing that a search could improve
        first = zero
    policies: dict[str, Callable[[], Policy]] = {
        "last": lambda: previous.policy if previous is not None else first,
        "zero": lambda: zero,
        "initial": lambda: first,
        "random": lambda: random_policy(zero, settings.seed + 1),
        "inverse": lambda: inverse_policy(task, settings, model),
    }
    return [policies[name]() for name in dict.fromkeys(settings.starts)]


def _search_policy(
    task: Task,
    settings: LearningSettings,
    objective: Objective,
    weights: Array,
    starts: Sequence[Policy],
    report: _Reporter,
) -> SearchResult:
    """Return the best policy found from the starts.

    The divergence is searched from where feature matching has come to: further off, where the
    deviation is many times the spread, it falls fastest by a wider prediction, and a search ends
    at policies that make the trajectory as uncertain as it is wrong.
    """
    matching = _feature_matching(task, settings, weights / task.scale**2)
    if settings.imitation == "feature_matching" and settings.horizon_stages > 1:
        staged = StagedSearch(
            objective,
            matching,
            settings.optimiser,
            settings.horizon_stages,
            settings.screening_evaluations,
            settings.evaluations,
        )
        return staged.search(starts, report.policy)
    objectives = [objective]
    if settings.imitation == "trajectory_kl":
        objectives.insert(0, dataclasses.replace(objective, cost=matching))
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


def _check_trials(task: Task, trials: Sequence[Rollout]) -> None:
    if not trials:
        raise InvalidSettingError("learning needs at least one trial; record one first")
    for number, trial in enumerate(trials):
        wanted = (task.horizon, task.control_size)
        if trial.states.shape != (task.horizon + 1, task.state_size) or (
            trial.controls.shape != wanted
        ):
            raise InvalidSettingError(
                f"trial {number} has states {trial.states.shape} and controls "
                f"{trial.controls.shape}; the task needs {(task.horizon + 1, task.state_size)} "
                f"and {wanted}"
            )
        if not trial.commanded:
            raise InvalidSettingError(
                f"trial {number} has no controls (all NaN): a dynamics model cannot learn from it"
            )


class _Reporter:
    """Turns the stages' own progress into that of the whole iteration."""

    MODEL_PART = 0.3

    def __init__(
        self, progress: Callable[[Progress], None] | None, settings: LearningSettings
    ) -> None:
        self._progress = progress
        tries = len(dict.fromkeys(settings.starts)) + settings.horizon_stages - 2
        self._evaluations = settings.evaluations + settings.screening_evaluations * tries
        self._search, self._searches = 0, 1

    def search(self, number: int, searches: int) -> None:
        """One search begins, of several that follow each other."""
        self._search, self._searches = number, searches

    def model(self, fraction: float) -> None:
        if self._progress is not None:
            self._progress(
                Progress("model", self.MODEL_PART * fraction, math.nan, 0, "training the model")
            )

    def policy(self, cost: float, evaluations: int) -> None:
        if self._progress is None:
            return
        done = (self._search + min(1.0, evaluations / self._evaluations)) / self._searches
        fraction = self.MODEL_PART + (1.0 - self.MODEL_PART) * done
        message = f"searching the policy: cost {cost:.4g} after {evaluations} evaluations"
        self._progress(Progress("policy", fraction, cost, evaluations, message))


def judge(task: Task, trial: Rollout) -> Errors:
    """Return how far a trial was from the demonstration (thesis (6.1)), over t = 1..H.

    Raises:
        InvalidSettingError: if the trial is not as long as the demonstration.
    """
    if trial.states.shape != (task.horizon + 1, task.state_size):
        raise InvalidSettingError(
            f"the trial's states have shape {trial.states.shape}; the task needs "
            f"{(task.horizon + 1, task.state_size)}"
        )
    deviations = task.feature_map.of(trial.states) - task.reference_features()
    mse = float(np.mean(deviations[1:] ** 2))
    return Errors(rmse=float(np.sqrt(mse)), mse=mse)
