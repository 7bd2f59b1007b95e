"""Algorithm 3 on a run directory: what has been done, what comes next, and how a trial went.

Neither the robot nor ROS is in here: the learner node runs the trials between `prepare` and
`finish`, and `irlpilco train` takes them from bags. The algorithm itself is the core's
`LearningLoop`; here is what is read and written around it.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from irlpilco_ros.experience.bag_files import bag_number
from irlpilco_ros.experience.best_trial import best_row, keep_best_policy, rows_here
from irlpilco_ros.experience.carried_over import Moved, carried_over, retimed
from irlpilco_ros.experience.demonstrated import Demonstrated
from irlpilco_ros.experience.demonstration_checks import checked_motions
from irlpilco_ros.experience.demonstrations import checked_demonstrations
from irlpilco_ros.experience.errors import (
    BagError,
    IncompleteTrialError,
    RunDirectoryError,
    UnreadableBagError,
)
from irlpilco_ros.experience.metrics import DEMONSTRATION, MetricsRow, with_path
from irlpilco_ros.experience.path_quality import PathQuality
from irlpilco_ros.experience.places import SAME, Place, read_places
from irlpilco_ros.experience.policy_file import BESIDE, policy_to_parameters
from irlpilco_ros.experience.practice import Adapted, Forecast, Plan, Practice, task_of_motions
from irlpilco_ros.experience.predicted_band import PredictedBand
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.run_directory import WINDOW, RunDirectory
from irlpilco_ros.experience.shown_motion import ShownMotion, Window
from irlpilco_ros.experience.speed_demand import too_slow
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.apprenticeship import LearningLoop
from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.learning.iteration import Iteration, Progress
from irlpilco_ros.learning.judgement import judge
from irlpilco_ros.learning.learn import weigh
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.settings import values_of
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.learning.task import Task

WITHOUT_EFFECT = ("threads",)
"""Settings that change how long learning takes, but not its results."""


_OF_A_TRIAL = ("start_position", "trial_horizon", "trial_control_period", *BESIDE)


@dataclass(frozen=True)
class TrialReport:
    """How one trial went.

    Attributes:
        row: Its row of metrics.csv.
        notes: What a reader should know, such as jitter that had to be added or that the task
            counts as learned.
    """

    row: MetricsRow
    notes: tuple[str, ...] = ()

    def sentence(self) -> str:
        """Return one readable line."""
        row = self.row
        line = (
            f"iteration {row.iteration}: trial {row.trial:03d} is {_off(row)} "
            f"(RMSE; error (6.1) {row.mse:.2e}), margin {row.margin:.2e}, cost {row.cost:.4g}, "
            f"{row.robot_time_s:g} s of robot time so far, {row.model_s:.1f} s in the model and "
            f"{row.policy_s:.1f} s in the policy"
        )
        return "; ".join([line, *self.notes])


def _off(row: MetricsRow) -> str:
    """Say how far off a trial was: on its path if that is known, and at the decisions."""
    if math.isnan(row.path_rmse_rad):
        return f"{row.rmse_rad:.4f} rad off"
    return f"{row.path_rmse_rad:.4f} rad off on its path, {row.rmse_rad:.4f} at the decisions"


def task_of(demonstrations: Sequence[Trajectory], robot: RobotSettings) -> Task:
    """Return the learning problem that one demonstration or several pose to a robot.

    Raises:
        BagError: a demonstration cannot be imitated by this robot.
    """
    return task_of_motions(checked_motions(demonstrations, robot), robot)


def controller_parameters(task: Task, policy: Policy, robot: RobotSettings) -> dict[str, Any]:
    """Return what the controller gets for a trial.

    That is the policy, its start [rad], how many decisions of which period [s], and what it
    imitates.
    """
    shown = Demonstrated(task.reference_states()[:, : len(robot.joints)])
    return {
        **policy_to_parameters(policy, robot.roles),
        **shown.to_parameters(),
        "start_position": shown.positions[0].tolist(),
        "trial_horizon": task.horizon,
        "trial_control_period": task.dt,
    }


def joint_rmse(task: Task, trial: Rollout, robot: RobotSettings) -> float:
    """Return how far the joints were from the demonstration, whatever it is compared by [rad].

    Root mean square over joints and steps t = 1..H; full turns of continuous joints do not count,
    and joints that slide are in [m].
    """
    joints = robot.roles
    off = (trial.states - task.reference_states())[1:, : len(joints.names)]
    turning = [joints.names.index(name) for name in joints.continuous]
    off[:, turning] = np.arctan2(np.sin(off[:, turning]), np.cos(off[:, turning]))
    return float(np.sqrt(np.mean(off**2)))


def configuration(
    robot: RobotSettings, settings: LearningSettings, topic: str = "", window: Window = ()
) -> dict[str, Any]:
    """Return everything that the results of a run depend on, but for demonstration and trials."""
    values = {**values_of(robot), **values_of(settings)}
    if robot.features == "tools":  # else they change nothing of what is learned
        values |= values_of(robot.tools)
    if topic:
        values["joint_states_topic"] = topic
    if window:
        values[WINDOW] = window
    return {key: value for key, value in values.items() if key not in WITHOUT_EFFECT}


def check_demonstration(
    directory: RunDirectory, source: Path, robot: RobotSettings, topic: str, window: Window
) -> None:
    """Check that a run can take bags for its demonstration, in place of one without a trial.

    Arguments are those of `Apprenticeship.open`.

    Raises:
        RunDirectoryError: the run has learned from another one.
        BagError: it cannot be read, or this robot cannot imitate it.
    """
    checked_demonstrations(source, robot, topic, window)
    directory.check_demonstration(source, replace=True)


class Apprenticeship:
    """One run of Algorithm 3, from wherever its run directory says that it stands.

    Attributes:
        directory: The run directory, claimed for writing.
        shown: What the demonstrations show, where it was shown.
        notes: What its user should know of bags that could not be read.
    """

    def __init__(
        self,
        directory: RunDirectory,
        robot: RobotSettings,
        settings: LearningSettings,
        shown: tuple[ShownMotion, ...],
    ) -> None:
        """Take up a run; use `open`."""
        self.directory = directory
        self.shown = shown
        self._robot = robot
        self._settings = settings
        self.notes: tuple[str, ...] = ()
        self._practices = [Practice.shown(directory, robot, shown)]
        for place in read_places(directory.places_directory):
            self._practices.append(Practice.carried(directory, robot, place, self._practices))
        trials = self._rollouts()
        tasks = [self._practice_of(number).task for number in range(len(trials))]
        last, best = self._last(len(trials)), self._best(len(trials))
        task = self._practice_of(len(trials)).task
        self._loop = LearningLoop(task, settings, trials, last, best, tasks)

    @property
    def task(self) -> Task:
        """The learning problem, where the object is now."""
        return self._practice.task

    @property
    def object_pose(self) -> Array | None:
        """Where the object is that the next trial is for (4, 4); None: where it was shown."""
        place = self._practice.place
        return place.object_pose if place is not None else None

    @property
    def speed(self) -> float:
        """How many times as fast as it was shown the next trial is to be."""
        return self.task.speed

    @property
    def _practice(self) -> Practice:
        """What the next trial is of; the last there is, unless a trial before it was lost."""
        return self._practice_of(self.next_index)

    def _practice_of(self, iteration: int) -> Practice:
        """Return what an iteration was for: the last that had begun by then."""
        return [each for each in self._practices if each.first <= iteration][-1]

    @classmethod
    def open(
        cls,
        path: Path,
        demonstration: Path | None,
        robot: RobotSettings,
        settings: LearningSettings,
        topic: str = "",
        window: Window = (),
        replace: bool = False,
    ) -> Self:
        """Begin a run, or go on with the one in this directory.

        Args:
            path: The run directory.
            demonstration: Bag to imitate, or folder of several bags NNN that show the same task;
                None for what the run directory holds.
            robot: The robot.
            settings: How to learn.
            topic: Which topic of joint states to take of bags where several tell the same joints.
            window: Begin and end of what is imitated, since the first sample of the demonstration
                [s]; empty for the motion that is found.
            replace: Whether the demonstration takes the place of one that nothing was learned from.

        Raises:
            RunDirectoryError: no demonstration, or the run was begun with another one or with
                another configuration, or another process works on it.
            BagError: the demonstration cannot be read or does not fit the robot; nothing was
                copied or changed.
        """
        directory = RunDirectory(path)
        source = demonstration or directory.demonstration_directory
        if not os.path.exists(source):
            if demonstration is not None:
                raise RunDirectoryError(
                    f"the demonstration {demonstration} is not there; name the bag of a recorded "
                    "demonstration, or a folder of several"
                )
            raise RunDirectoryError(
                f"{path} has no demonstration yet; set the learner's parameter `demonstration` "
                "to the bag of a recorded demonstration"
            )
        asked = configuration(robot, settings, topic, window)
        try:
            shown = checked_demonstrations(source, robot, topic, window)
        except BagError:
            directory.check_configuration(asked, replace)  # which may be why
            raise
        directory.claim(asked, source, replace)
        try:
            run = cls(directory, robot, settings, shown)
            run._judge_the_unjudged()
            run.notes += run._keep_best()
        except BaseException:
            directory.release()
            raise
        return run

    def about_demonstration(self) -> list[str]:
        """Return a line for each demonstration: what of it is imitated, and what to know of it."""
        lines = []
        for each in self.shown:
            what = each.motion.sentence() if each.motion else f"imitated from {each.begin:.1f} s on"
            steps = f"{each.rollout.steps} decisions of {self.task.dt:g} s"
            lines.append("; ".join([f"demonstration: {what}; {steps}", *each.notes]))
        return lines

    @property
    def next_index(self) -> int:
        """Iteration k whose trial comes next; 0 is the initial trial."""
        return len(self._loop.trials)

    @property
    def latest_error(self) -> float:
        """How far off the latest trial was [rad]; NaN before the first."""
        rows = self.directory.metrics()
        return rows[-1].error_rad if rows else math.nan

    def close(self) -> None:
        """Let others work on the run directory."""
        self.directory.release()

    def prepare(self, progress: Callable[[Progress], None] | None = None) -> Plan:
        """Learn from all trials so far and write down what the next trial is to be.

        What an interrupted run has already found out for this trial is taken as it is.

        Args:
            progress: Called while learning; what it raises breaks off, and nothing is written.
        """
        iteration = self._with_note(self._loop.propose(progress))
        parameters = controller_parameters(self.task, iteration.policy, self._robot)
        band = PredictedBand.of(iteration, self._robot.roles)
        if band is not None:
            parameters |= band.to_parameters()
        self._write(iteration, self._alone(parameters))
        return Plan(iteration, parameters)

    def adapt(
        self,
        moved: Moved | None,
        speed: float,
        error_limit: float,
        progress: Callable[[Progress], None] | None = None,
    ) -> Adapted:
        """Go on where the object is now, and so fast, with a policy from all trials so far.

        Args:
            moved: Where the object is now; None for where it was shown, wherever that is.
            speed: How many times as fast as it was shown.
            error_limit: Largest predicted error that is accepted [rad].
            progress: As for `prepare`.

        Raises:
            UnreachableError: the tools cannot be where they have to be there, or the model does
                not vouch for the policy; nothing was written.
        """
        index = self.next_index
        shown = self._carried(moved, speed)
        place = Place(index, None, shown, speed)
        if moved is not None:
            place = Place(index, moved.object_pose, shown, speed, moved.moves[0])
        practice = Practice.carried(self.directory, self._robot, place, self._practices)
        loop, task = self._loop, practice.task
        there = LearningLoop(task, self._settings, loop.trials, loop.last, None, loop.tasks)
        iteration = there.move(task, progress)
        forecast = Forecast.of(task, iteration, len(self._robot.joints))
        forecast.check(error_limit)
        self.directory.begin_place(place)
        self._practices.append(practice)
        self._loop = there
        return Adapted(len(self._practices) - 1, self.prepare(), forecast)

    def _carried(self, moved: Moved | None, speed: float) -> tuple[ShownMotion, ...]:
        """Return the demonstrations there and so fast; none if that is as they were shown."""
        moves = [] if moved is None else moved.moves
        if moved is None or max(np.abs(move - np.eye(4)).max() for move in moves) <= SAME:
            if speed == 1.0:
                return ()
            return tuple(retimed(each, self._robot, speed) for each in self.shown)
        for each in self._practices:
            if each.is_at(moved.object_pose, speed):
                return each.motions
        return tuple(
            carried_over(each, move, moved.carrier, self._robot, speed)
            for each, move in zip(self.shown, moves, strict=True)
        )

    def finish(self, bag: Path) -> TrialReport:
        """Judge the recorded trial of what was prepared and write its row.

        Raises:
            IncompleteTrialError: the bag holds no whole trial; it stays, and the trial of this
                iteration is still to be done.
        """
        report = self._take(self._read(bag, self.task), bag)
        if self.next_index in self.directory.iterations():  # a trial that was lost is done again
            self._judge_the_unjudged()
        return report

    def replay_parameters(self) -> dict[str, Any]:
        """Return what the controller needs to replay the demonstration's own speeds."""
        return controller_parameters(self.task, open_loop_policy(self.task), self._robot)

    def finish_replay(self, bag: Path) -> MetricsRow:
        """Judge the open-loop replay, the baseline, and write its row.

        Raises:
            IncompleteTrialError: the bag holds no whole trial.
        """
        rollout = self._read(bag, self.task)
        off, mse = joint_rmse(self.task, rollout, self._robot), judge(self.task, rollout).mse
        nan = math.nan
        row = MetricsRow(None, bag_number(bag), off, mse, nan, nan, 0.0, 0.0, 0.0)
        return self._append(row, self._practice.paths.trial(bag))

    def _append(self, row: MetricsRow, path: PathQuality) -> MetricsRow:
        """Write a row with what is known of the path; before the first one, the demonstration's."""
        if self.directory.baseline_metrics(DEMONSTRATION) is None:
            nan = math.nan
            shown = MetricsRow(None, 0, 0.0, 0.0, nan, nan, 0.0, 0.0, 0.0, baseline=DEMONSTRATION)
            self.directory.append_metrics(with_path(shown, self._practice.paths.demonstration()))
        whole = with_path(row, path)
        self.directory.append_metrics(whole)
        return whole

    def _with_note(self, iteration: Iteration) -> Iteration:
        """Return an iteration with a note if its policy is slower than what it imitates."""
        note = too_slow(self.task, iteration.policy, self._robot)
        if note and note not in iteration.notes:
            iteration = dataclasses.replace(iteration, notes=(*iteration.notes, note))
            self._loop.last = iteration
        return iteration

    def _last(self, trials: int) -> Iteration | None:
        """Return what was learned from that many trials, or from one less, if anything was."""
        index = trials if trials in self.directory.iterations() else trials - 1
        return self.directory.read_iteration(index) if index > 0 else None

    def _best(self, trials: int) -> Iteration | None:
        """Return the iteration whose trial was the best of those of what comes after that many.

        None if it cannot be had.
        """
        row = best_row(rows_here(self.directory))
        if row is None or row.iteration is None:
            return None
        if self._practice_of(row.iteration).task is not self._practice_of(trials).task:
            return None  # a trial elsewhere was lost, and is to be done first
        try:
            if row.iteration == 0:
                return Iteration(0, self.directory.read_policy(0))
            return self.directory.read_iteration(row.iteration)
        except IrlPilcoError as error:
            self.notes += (f"what the best trial so far was done with cannot be read: {error}",)
            return None

    def _keep_best(self) -> tuple[str, ...]:
        """Bring best_policy.yaml up to date; return why not, if it cannot be."""
        try:
            keep_best_policy(self.directory)
        except IrlPilcoError as error:
            return (f"best_policy.yaml is not up to date: {error}",)
        return ()

    def _write(self, iteration: Iteration, parameters: dict[str, Any]) -> None:
        """Write what is to be tried, unless that has been done already."""
        if iteration.index == 0:
            self.directory.write_policy(0, iteration.policy, self._robot.roles, parameters)
        elif iteration.index not in self.directory.iterations():
            self.directory.write_iteration(iteration, self._robot.roles, parameters)

    def _alone(self, parameters: dict[str, Any]) -> dict[str, Any]:
        """Return what a policy file holds beside the policy, to run it without anything else."""
        own = {name: parameters[name] for name in _OF_A_TRIAL if name in parameters}
        robot = {
            name: value
            for name, value in values_of(self._robot).items()
            if value != ()  # an empty list in a parameter file has no type
        }
        return {**robot, **own}

    def _read(self, bag: Path, task: Task) -> Rollout:
        return self.directory.read_trial(
            bag, self._robot.roles, task.horizon, self._robot.control_period
        )

    def _rollouts(self) -> list[Rollout]:
        """Return the trials that have been judged, in order, up to the first that is lost."""
        rollouts: list[Rollout] = []
        for row in self.directory.metrics():
            bag = self.directory.trials_directory / f"{row.trial:03d}"
            try:
                rollouts.append(self._read(bag, self._practice_of(len(rollouts)).task))
            except (UnreadableBagError, IncompleteTrialError) as error:
                kept = self.directory.withdraw(len(rollouts))
                note = f"the trial of iteration {len(rollouts)} is lost, and is to be done again"
                self.notes += (f"{note}: {error} (metrics.csv as it was: {kept.name})",)
                break
        return rollouts

    def _judge_the_unjudged(self) -> None:
        """Write the rows of trials that were recorded before somebody was killed."""
        robot, limits = self._robot, self._robot.acceleration_limits
        reach = limits * robot.control_period if limits.size else None
        search = self.directory.search_trials(
            robot.roles,
            lambda iteration: self._practice_of(iteration).task.horizon,
            self.next_index,
            robot.control_period,
            reach,
        )
        for bag, error in search.wrong.items():
            self.notes += (self._pass_over(bag, error),)
        while (trial := search.trials.get(self.next_index)) is not None:
            if self.next_index == 0:
                self._loop.last = Iteration(0, self.directory.read_policy(0))
            else:
                self._loop.last = self.directory.read_iteration(self.next_index)
            self._take(trial.rollout, trial.path)
        if self.next_index in self.directory.iterations():
            self._loop.last = self.directory.read_iteration(self.next_index)

    def _pass_over(self, bag: Path, error: BagError) -> str:
        """Return what to say of a bag without a whole trial; set it aside if it is unreadable."""
        if isinstance(error, UnreadableBagError):
            aside = self.directory.set_aside(bag)
            return f"{bag.name} cannot be read, and is now called {aside.name}: {error}"
        return f"{bag.name} is passed over: {error}"

    def _take(self, trial: Rollout, bag: Path) -> TrialReport:
        """Judge a trial, write its row and go on from it."""
        task, paths = self.task, self._practice.paths
        iteration = self._loop.take(trial)
        _, margin = weigh(task, self._settings, self._loop.trials, self._loop.tasks)
        row = MetricsRow(
            iteration=iteration.index,
            trial=bag_number(bag),
            rmse_rad=joint_rmse(task, trial, self._robot),
            mse=judge(task, trial).mse,
            margin=margin,
            cost=iteration.cost,
            robot_time_s=sum(own.horizon for own in self._loop.tasks) * task.dt,
            model_s=iteration.model_seconds,
            policy_s=iteration.policy_seconds,
        )
        row = self._append(row, paths.trial(bag))
        if self.task is not task:  # what had been lost has been done
            self._loop.task, self._loop.best = self.task, None
        notes = [*iteration.notes, *self._keep_best()]
        if iteration.learned:
            notes.append("the margin is within margin_tolerance: learned")
        best = best_row(rows_here(self.directory))
        if best is not None and best.iteration != row.iteration:
            notes.append(
                f"the best so far is iteration {best.iteration}: {best.rmse_rad:.4f} rad off"
            )
        return TrialReport(row, tuple(notes))
