"""The same motion at another place or speed: a policy from the model as it is, without a trial.

The dynamics belong to the robot and not to the place. What was commanded in a trial elsewhere, plus
what is shown faster or slower here, is nearly right already (the feed-forward of iterative learning
control, carried over); from there policy search goes on in the model of all trials of all places.
At another speed, what was commanded beside what was shown is scaled as the speeds are.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence

import numpy as np

from irlpilco_ros.learning.conclusion import concluded
from irlpilco_ros.learning.elsewhere import model_elsewhere
from irlpilco_ros.learning.iteration import Iteration, Progress
from irlpilco_ros.learning.judgement import trial_error
from irlpilco_ros.learning.lag import with_known_history
from irlpilco_ros.learning.learn import (
    check_trials,
    expected_cost,
    learn,
    trials_of,
    weigh,
)
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.squashing import unsquash
from irlpilco_ros.learning.numerics.threads import one_blas_thread
from irlpilco_ros.learning.pace import at_moments_of, ways_at_pace_of
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.search.policy_search import search_policy
from irlpilco_ros.learning.starts.initial_policy import initial_policy, policy_limit
from irlpilco_ros.learning.task import Task

EVALUATIONS = 2
"""Of the search in a model whose mean is linear, on top of that of the start.

One brings the mean onto what is shown. More of them fit the gains to coefficients that few trials
do not tell well enough for that: after three or four trials, four evaluations made arms swing
(7 to 12 mrad off where it is 4 to 7 with two)."""


def adapt(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    tasks: Sequence[Task],
    last: Iteration | None,
    progress: Callable[[Progress], None] | None = None,
) -> Iteration:
    """Return a policy for a task that was learned elsewhere, before its first trial.

    Args:
        task: The motion, carried over.
        settings: How to learn.
        trials: Every trial so far, in the order they were made.
        tasks: What each was a trial of: the same motion elsewhere, or at another speed.
        last: The last iteration, for its gains and the model's hyperparameters; None if there was
            none.
        progress: As for `learn`.

    Returns:
        The iteration, its index the number of trials so far; where there is none, it has the
        initial policy. The hyperparameters are those of the last iteration.

    Raises:
        InvalidSettingError: a trial does not fit the task.
        NumericalError: no finite prediction can be made.
    """
    if not trials:
        return Iteration(0, initial_policy(task, settings))
    if last is None or not last.hyperparameters.log_signal.size:
        return learn(task, settings, trials, None, progress, None, tasks)
    check_trials(task, trials, tasks)
    settings = with_known_history(task, settings, trials)
    start = carried_policy(task, settings, trials, tasks, last.policy)
    if start is None:
        seen = task.remembering(settings.command_history)
        first = dataclasses.replace(last, policy=initial_policy(seen, settings))
        return learn(task, settings, trials, first, progress, None, tasks)
    weighed = weigh(task, settings, trials, tasks)
    here, began = trials_of(task, trials, tasks), time.perf_counter()
    task = task.remembering(settings.command_history)
    known = settings.prior_mean == "identified"
    evaluations = EVALUATIONS if known else settings.screening_evaluations
    with one_blas_thread():
        model = model_elsewhere(task, settings, trials, tasks, last.hyperparameters)
        modelled = time.perf_counter()
        objective = expected_cost(task, settings, model, here, weighed[0])
        found = search_policy(
            objective.with_wider_start(settings.start_widening),
            [start],
            settings.optimiser,
            evaluations,
            _told(progress, evaluations + 1),
        )
        iteration = concluded(task, trials, objective, found, weighed, last)
        searched = time.perf_counter()
    return dataclasses.replace(
        iteration,
        hyperparameters=last.hyperparameters,
        model_seconds=modelled - began,
        policy_seconds=searched - modelled,
        notes=model.notes,
    )


def carried_policy(
    task: Task,
    settings: LearningSettings,
    trials: Sequence[Rollout],
    tasks: Sequence[Task],
    policy: Policy,
) -> Policy | None:
    """Return a policy's gains about this task, with the feed-forward of the nearest trial.

    Nearest is the place whose shown joint positions are, moment by moment; of its trials the best
    counts. What was commanded there is changed by as much as the shown speeds are others here. None
    if this kind of policy has no gains that could be kept.
    """
    size, reference = task.state_size // 2, task.reference_states()

    def distance(number: int) -> float:
        other = at_moments_of(task, tasks[number], tasks[number].reference_states())
        return float(np.abs(other - reference)[:, :size].max())

    numbers = range(len(trials))
    nearest = min(map(distance, numbers))
    near = [number for number in numbers if distance(number) <= nearest]
    best = min(near, key=lambda number: trial_error(tasks[number], trials[number]))
    limit = policy_limit(task, settings)
    shown = tasks[best].demonstrated_controls()
    beside = ways_at_pace_of(task, tasks[best], trials[best].controls - shown)
    controls = np.clip(task.demonstrated_controls() + beside, -limit, limit)
    layout = task.remembering(settings.command_history).state_layout
    states = layout.policy_view(layout.whole_states(reference, controls)[:-1])
    return policy.along(states, unsquash(controls, limit), limit)


def _told(
    progress: Callable[[Progress], None] | None, evaluations: int
) -> Callable[[float, int], None] | None:
    if progress is None:
        return None

    def tell(cost: float, done: int) -> None:
        message = f"adapting the policy: cost {cost:.4g} after {done} evaluations"
        progress(Progress("policy", min(1.0, done / evaluations), cost, done, message))

    return tell
