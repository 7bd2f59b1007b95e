"""The loop of thesis Algorithms 3 (IRL/PILCO) and 2 (PILCO): learn, try, and learn again."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

from irlpilco_ros.learning.adapt import adapt
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.iteration import Iteration, Progress
from irlpilco_ros.learning.judgement import trial_error
from irlpilco_ros.learning.learn import learn
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.starts.initial_policy import initial_policy
from irlpilco_ros.learning.task import Task

RunTrial = Callable[[Policy], Rollout]
"""Runs one trial of `task.horizon` steps from the task's start; the policy sees the view of
`task.state_layout.policy_view(state)`."""


class LearningLoop:
    """Both halves of a pass of the loop, for who has to wait for a trial between them.

    `apprenticeship` and `pilco` call them in turn. A robot's learner calls `propose`, waits until
    the robot has done the trial, and calls `take`.

    Attributes:
        task: What is to be learned.
        settings: How.
        trials: Every trial so far, in the order they were made.
        tasks: What each of them was a trial of: of `task`, or of the same motion elsewhere.
        last: The last iteration; None before the first.
        best: The iteration whose trial of `task` was the best so far; None before the first.
    """

    def __init__(
        self,
        task: Task,
        settings: LearningSettings,
        trials: Sequence[Rollout] = (),
        last: Iteration | None = None,
        best: Iteration | None = None,
        tasks: Sequence[Task] | None = None,
    ) -> None:
        """Begin, or go on with trials that were made, the last iteration so far and the best.

        If the best is not told, it is the best of those that will be tried. If the trials' tasks
        are not told, all were trials of `task`.

        Raises:
            InvalidSettingError: the last iteration learned from more trials than there are, or the
                best was not tried.
        """
        if last is not None and last.index > len(trials):
            raise InvalidSettingError(
                f"the last iteration learned from {last.index} trials, but {len(trials)} were "
                "given; hand in all trials so far"
            )
        if best is not None and best.index >= len(trials):
            raise InvalidSettingError(
                f"the best iteration is {best.index}, but {len(trials)} trials were given; hand in "
                "the trial of its policy, too"
            )
        self.task = task
        self.settings = settings
        self.trials = list(trials)
        self.tasks = [task] * len(self.trials) if tasks is None else list(tasks)
        self.last = last
        self.best = best

    @property
    def finished(self) -> bool:
        """Whether the margin is within its tolerance, and the policy of that has been tried."""
        return self.last is not None and self.last.learned and self.last.index < len(self.trials)

    def propose(self, progress: Callable[[Progress], None] | None = None) -> Iteration:
        """Return what to try next: the initial policy, or what is learned from the trials so far.

        What has been proposed and not tried yet is proposed again, without learning again.

        Args:
            progress: Told where learning stands; whatever it raises cancels learning, and the loop
                stands where it stood.

        Raises:
            InvalidSettingError: a trial does not fit the task, or the settings do not.
            NumericalError: no finite prediction can be made.
        """
        if self.last is None or self.last.index < len(self.trials):
            if self.trials:
                last = self._learned(progress)
            else:
                last = Iteration(0, initial_policy(self.task, self.settings))
            self.last = last
        return self.last

    def move(self, task: Task, progress: Callable[[Progress], None] | None = None) -> Iteration:
        """Go on with another task, the same motion elsewhere; return what to try there first.

        It comes from the trials so far (see `adapt`). What was proposed and not tried is dropped.

        Raises:
            InvalidSettingError: the task has another size.
            NumericalError: no finite prediction can be made.
        """
        last = adapt(task, self.settings, self.trials, self.tasks, self.last, progress)
        self.task, self.last, self.best = task, last, None
        return last

    def _learned(self, progress: Callable[[Progress], None] | None) -> Iteration:
        task, settings, trials, tasks = self.task, self.settings, self.trials, self.tasks
        if not any(own is task for own in tasks):
            return adapt(task, settings, trials, tasks, self.last, progress)
        return learn(task, settings, trials, self.last, progress, self.best, tasks)

    def take(self, trial: Rollout) -> Iteration:
        """Take in the trial of what was proposed last, and return that iteration with it.

        Raises:
            InvalidSettingError: nothing is proposed that has not been tried, or the trial does not
                fit the task.
        """
        if self.last is None or self.last.index < len(self.trials):
            raise InvalidSettingError(
                f"trial {len(self.trials)} belongs to no iteration; call propose() before it"
            )
        error = trial_error(self.task, trial)
        self.trials.append(trial)
        self.tasks.append(self.task)
        self.last = dataclasses.replace(self.last, tried=trial)
        if self.best is None or error < trial_error(self.task, self.trials[self.best.index]):
            self.best = self.last
        return self.last


def apprenticeship(
    task: Task,
    settings: LearningSettings,
    run_trial: RunTrial,
    trials: Sequence[Rollout] = (),
    last: Iteration | None = None,
    progress: Callable[[Progress], None] | None = None,
    best: Iteration | None = None,
) -> Iterator[Iteration]:
    """Run IRL/PILCO (thesis Algorithm 3): imitate the task's demonstrations.

    Iteration 0 tries the initial policy. Every later one weighs the features, trains the dynamics
    model, searches the policy and tries it. The same arguments give the same bits.

    Args:
        task: What is to be learned, with demonstrations.
        settings: How.
        run_trial: Runs a policy on the robot and returns what happened.
        trials: Trials of a run that is taken up, in the order they were made.
        last: Its last iteration; if its policy has not been tried yet, that is what comes first.
        progress: Told where learning stands; whatever it raises ends the loop.
        best: The iteration of a run that is taken up whose trial was the best; a search that comes
            out much worse than before starts again from its policy.

    Yields:
        Each iteration with its trial, until `settings.margin_tolerance` is met: a caller that wants
        fewer leaves the loop.

    Raises:
        InvalidSettingError: the task has no demonstrations, or a trial does not fit it.
        NumericalError: no finite prediction can be made.
    """
    if not task.demonstrations:
        raise InvalidSettingError("the task has no demonstration to imitate; pilco() takes a cost")
    return _iterations(LearningLoop(task, settings, trials, last, best), run_trial, progress)


def pilco(
    task: Task,
    settings: LearningSettings,
    run_trial: RunTrial,
    trials: Sequence[Rollout] = (),
    last: Iteration | None = None,
    progress: Callable[[Progress], None] | None = None,
    best: Iteration | None = None,
) -> Iterator[Iteration]:
    """Run classical PILCO (thesis Algorithm 2; Deisenroth & Rasmussen 2011): a cost is given.

    Arguments, iterations and errors are those of `apprenticeship`; the task has a cost, and nothing
    but the caller ends the loop. The paper's settings are `initial_policy="random_controls"`,
    `prior_mean="zero"`, `hyperprior="pilco"`, `policy="rbf"` and `optimiser="bfgs"`.
    """
    if task.cost is None:
        raise InvalidSettingError("the task has no cost; apprenticeship() imitates demonstrations")
    return _iterations(LearningLoop(task, settings, trials, last, best), run_trial, progress)


def _iterations(
    loop: LearningLoop, run_trial: RunTrial, progress: Callable[[Progress], None] | None
) -> Iterator[Iteration]:
    while not loop.finished:
        iteration = loop.propose(progress)
        yield loop.take(run_trial(iteration.policy))
