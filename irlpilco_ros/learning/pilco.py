"""Classical PILCO (thesis Algorithm 2; Deisenroth & Rasmussen 2011): a known cost, no expert."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.costs import Cost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.trial_data import train_on_trials
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.threads import one_blas_thread
from irlpilco_ros.learning.policies import (
    LinearPolicy,
    OpenLoopPolicy,
    Policy,
    RbfPolicy,
    initial_policy,
)
from irlpilco_ros.learning.prediction.model_input import extended_state
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.prediction.predicted_trajectory import PredictedTrajectory
from irlpilco_ros.learning.prediction.state_layout import StateLayout
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.search.policy_search import SearchProgress, SearchResult, search_policy

_BEGINNING = 2.0 / 3.0  # of a trial


@dataclass(frozen=True)
class ControlTask:
    """What is to be controlled, and what it costs.

    Attributes:
        layout: What the model and the policy see of the state.
        start: State at the start of every trial.
        horizon: Number of steps H.
        control_limit: Largest absolute value of each control, shape (F,).
        cost: What a predicted trajectory costs.
    """

    layout: StateLayout
    start: Gaussian
    horizon: int
    control_limit: Array
    cost: Cost


@dataclass(frozen=True)
class PilcoIteration:
    """One pass of Algorithm 2.

    Attributes:
        index: Number of trials that it learned from.
        policy: The policy for the next trial; it sees `layout.policy_view(state)`.
        hyperparameters: Of the dynamics model.
        cost: Predicted cost of the policy.
        prediction: The trajectory that it is expected to take.
        evaluations: Cost evaluations that the policy search took.
    """

    index: int
    policy: Policy
    hyperparameters: Hyperparameters
    cost: float
    prediction: PredictedTrajectory
    evaluations: int


def pilco(
    task: ControlTask,
    settings: LearningSettings,
    run_trial: Callable[[Policy], Rollout],
    iterations: int,
) -> Iterator[PilcoIteration]:
    """Run Algorithm 2: a trial with random controls, then learn, try, and learn again.

    Args:
        task: What is to be controlled.
        settings: `policy` ("rbf" or "linear"), `rbf.count`, `optimiser`, `evaluations`,
            `covariance_approximation`, `seed` and `threads` are used.
        run_trial: Runs a policy on the system and returns what happened.
        iterations: How often to learn.

    Yields:
        Each iteration, before its policy is tried.
    """
    trials = [run_trial(random_controls(task, settings.seed))]
    previous: PilcoIteration | None = None
    for _ in range(iterations):
        previous = improve(task, settings, trials, previous)
        yield previous
        trials.append(run_trial(previous.policy))


def improve(
    task: ControlTask,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    previous: PilcoIteration | None = None,
    progress: SearchProgress | None = None,
) -> PilcoIteration:
    """Do one pass of Algorithm 2 on all trials so far.

    Args:
        task: What is to be controlled.
        settings: As for `pilco`.
        trials: At least one.
        previous: The pass before; its hyperparameters and policy are where training and search
            start.
        progress: Told the best cost and the number of evaluations so far, first of the beginning
            of the trial, then of all of it; may raise to cancel.

    Raises:
        InvalidSettingError: if there is no trial, or the policy kind is not for control.
        NumericalError: if no finite prediction can be made.
    """
    if not trials:
        raise InvalidSettingError("learning needs at least one trial; record one first")
    warm_start = previous.hyperparameters if previous is not None else None
    policy = previous.policy if previous is not None else random_start(task, settings)
    with one_blas_thread():
        model = train_on_trials(trials, task.layout, None, warm_start, settings.threads)
        approximation: CovarianceApproximation = (
            "exact" if settings.covariance_approximation == "exact" else "first_order"
        )
        objective = Objective(
            model, task.start, task.horizon, task.layout, task.cost, approximation=approximation
        )
        found = _search(objective, policy, settings, progress)
        prediction = objective.evaluate(found.policy, gradient=False).trajectory
    return PilcoIteration(
        index=len(trials),
        policy=found.policy,
        hyperparameters=model.hyperparameters,
        cost=found.cost,
        prediction=prediction,
        evaluations=found.evaluations,
    )


def search_evaluations(settings: LearningSettings) -> int:
    """Return how many evaluations `improve` may take: half as many over the beginning first."""
    return settings.evaluations + settings.evaluations // 2


def _search(
    objective: Objective,
    policy: Policy,
    settings: LearningSettings,
    progress: SearchProgress | None,
) -> SearchResult:
    """Search on from a policy, first for what is cheap over the beginning of the trial.

    Over the whole trial there are local optima that get to the target in the end, after a detour
    that no small change makes shorter. Over the beginning alone such a detour is worth nothing.
    """
    beginning = dataclasses.replace(objective, horizon=math.ceil(_BEGINNING * objective.horizon))
    first = search_evaluations(settings) - settings.evaluations
    led = search_policy(beginning, [policy], settings.optimiser, first, progress)

    def tell(cost: float, evaluations: int) -> None:
        if progress is not None:
            progress(cost, led.evaluations + evaluations)

    found = search_policy(objective, [led.policy], settings.optimiser, settings.evaluations, tell)
    return dataclasses.replace(found, evaluations=led.evaluations + found.evaluations)


def random_controls(task: ControlTask, seed: int) -> OpenLoopPolicy:
    """Return controls drawn evenly from within the limit, for the first trial."""
    seen = len(task.layout.policy_inputs or ())
    return initial_policy.random_controls(task.horizon, task.control_limit, seen, seed)


def random_start(task: ControlTask, settings: LearningSettings) -> Policy:
    """Return the policy that the first search starts from, as PILCO draws it.

    Bumps of width one lie where trials start, with small random heights.

    Raises:
        InvalidSettingError: if the policy kind is neither "rbf" nor "linear".
    """
    rng = np.random.default_rng(settings.seed + 1)
    F = len(task.control_limit)
    extended, _ = extended_state(task.start, task.layout)
    viewed = list(task.layout.policy_inputs or ())
    if settings.policy == "linear":
        weights = 0.1 * rng.standard_normal((F, len(viewed)))
        return LinearPolicy(weights, np.zeros(F), task.control_limit)
    if settings.policy != "rbf":
        raise InvalidSettingError(
            f"policy is {settings.policy!r}; classical PILCO learns one of: rbf, linear"
        )
    spread = extended.covariance[np.ix_(viewed, viewed)]
    count = settings.options_of(RbfPolicy).count
    centres = rng.multivariate_normal(extended.mean[viewed], spread, count, method="eigh")
    targets = 0.1 * rng.standard_normal((count, F))
    return RbfPolicy(centres, targets, np.zeros((F, len(viewed))), task.control_limit)
