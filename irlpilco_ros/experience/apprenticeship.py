"""Algorithm 3 on a run directory: what has been done, what comes next, and how a trial went.

Neither the robot nor ROS is in here: the learner node runs the trials between `prepare` and
`finish`, and `irlpilco train` takes them from bags.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from irlpilco_ros.experience.bag_files import bag_number
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.metrics import MetricsRow
from irlpilco_ros.experience.policy_file import policy_to_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.irl_pilco import initial_policy, judge, learn, open_loop_policy, weigh
from irlpilco_ros.learning.iteration import Iteration, Progress
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.settings import values_of
from irlpilco_ros.learning.task import Task

WITHOUT_EFFECT = ("threads",)
"""Settings that change how long learning takes, but not its results."""


@dataclass(frozen=True)
class Plan:
    """The trial that comes next.

    Attributes:
        index: Iteration k; 0 is the initial trial.
        policy: What the robot is to do.
        parameters: What the controller needs for it: policy and start position [rad].
        iteration: What was learned for it; None for the initial trial.
    """

    index: int
    policy: Policy
    parameters: dict[str, Any]
    iteration: Iteration | None


@dataclass(frozen=True)
class TrialReport:
    """How one trial went.

    Attributes:
        row: Its row of metrics.csv.
        notes: What a reader should know of the computing, such as jitter that had to be added.
    """

    row: MetricsRow
    notes: tuple[str, ...] = ()

    def sentence(self) -> str:
        """Return one readable line."""
        row = self.row
        line = (
            f"iteration {row.iteration}: trial {row.trial:03d} is {row.rmse_rad:.4f} rad off "
            f"(RMSE; error (6.1) {row.mse:.2e}), margin {row.margin:.2e}, cost {row.cost:.4g}, "
            f"{row.robot_time_s:g} s of robot time so far, {row.model_s:.1f} s in the model and "
            f"{row.policy_s:.1f} s in the policy"
        )
        return "; ".join([line, *self.notes])


def task_of(demonstrations: Sequence[Trajectory], robot: RobotSettings) -> Task:
    """Return the learning problem that one demonstration or several pose to a robot.

    Raises:
        BagError: a demonstration lacks a joint or is shorter than a trial.
    """
    joints = robot.roles
    return Task(
        tuple(shown.rollout(joints, robot.horizon) for shown in demonstrations),
        robot.control_period,
        robot.control_limit,
        joints.features,
        layout=joints.layout,
        start_spread=robot.start_spread,
    )


def controller_parameters(task: Task, policy: Policy, robot: RobotSettings) -> dict[str, Any]:
    """Return what the controller needs for a trial: the policy, and where it starts [rad]."""
    start = task.reference_states()[0, : len(robot.joints)]
    return {**policy_to_parameters(policy, robot.roles), "start_position": start.tolist()}


def configuration(robot: RobotSettings, settings: LearningSettings) -> dict[str, Any]:
    """Return everything that the results of a run depend on, but for demonstration and trials."""
    values = {**values_of(robot), **values_of(settings)}
    return {key: value for key, value in values.items() if key not in WITHOUT_EFFECT}


class Apprenticeship:
    """One run of Algorithm 3, from wherever its run directory says that it stands.

    Attributes:
        directory: The run directory, claimed for writing.
        task: The learning problem.
    """

    def __init__(
        self, directory: RunDirectory, robot: RobotSettings, settings: LearningSettings
    ) -> None:
        """Take up a run; use `open`."""
        self.directory = directory
        self.task = task_of(directory.demonstrations(), robot)
        self._robot = robot
        self._settings = settings

    @classmethod
    def open(
        cls,
        path: Path,
        demonstration: Path | None,
        robot: RobotSettings,
        settings: LearningSettings,
    ) -> Self:
        """Begin a run, or go on with the one in this directory.

        Args:
            path: The run directory.
            demonstration: Bag to imitate, or folder of several bags NNN that show the same task;
                None for what the run directory holds.
            robot: The robot.
            settings: How to learn.

        Raises:
            RunDirectoryError: no demonstration, or the run was begun with another one or with
                another configuration, or another process works on it.
            BagError: the demonstration cannot be read or does not fit the robot.
        """
        directory = RunDirectory(path)
        source = demonstration or directory.demonstration_directory
        if not source.exists():
            if demonstration is not None:
                raise RunDirectoryError(
                    f"the demonstration {demonstration} is not there; name the bag of a recorded "
                    "demonstration, or a folder of several"
                )
            raise RunDirectoryError(
                f"{path} has no demonstration yet; set the learner's parameter `demonstration` "
                "to the bag of a recorded demonstration"
            )
        directory.claim(configuration(robot, settings), source)
        try:
            run = cls(directory, robot, settings)
            run._judge_the_unjudged()
        except BaseException:
            directory.release()
            raise
        return run

    @property
    def next_index(self) -> int:
        """Iteration k whose trial comes next; 0 is the initial trial."""
        return len(self.directory.metrics())

    def close(self) -> None:
        """Let others work on the run directory."""
        self.directory.release()

    def prepare(self, progress: Callable[[Progress], None] | None = None) -> Plan:
        """Learn from all trials so far and write down what the next trial is to be.

        What an interrupted run has already found out for this trial is taken as it is.

        Args:
            progress: Called while learning; what it raises breaks off, and nothing is written.
        """
        index = self.next_index
        iteration = None
        if index == 0:
            policy = initial_policy(self.task, self._settings)
            parameters = controller_parameters(self.task, policy, self._robot)
            self.directory.write_policy(0, policy, self._robot.roles, self._alone(parameters))
        else:
            iteration = self._iteration(index, progress)
            policy = iteration.policy
            parameters = controller_parameters(self.task, policy, self._robot)
        return Plan(index, policy, parameters, iteration)

    def finish(self, plan: Plan, bag: Path) -> TrialReport:
        """Judge the recorded trial of a plan and write its row.

        Raises:
            IncompleteTrialError: the bag holds no whole trial; it stays, and the trial of this
                iteration is still to be done.
        """
        rollout = read_bag(bag).rollout(self._robot.roles, self._robot.horizon)
        row = self._row(plan.index, plan.iteration, bag_number(bag), rollout)
        self.directory.append_metrics(row)
        return TrialReport(row, plan.iteration.notes if plan.iteration else ())

    def replay_parameters(self) -> dict[str, Any]:
        """Return what the controller needs to replay the demonstration's own speeds."""
        return controller_parameters(self.task, open_loop_policy(self.task), self._robot)

    def finish_replay(self, bag: Path) -> MetricsRow:
        """Judge the open-loop replay, the baseline, and write its row.

        Raises:
            IncompleteTrialError: the bag holds no whole trial.
        """
        rollout = read_bag(bag).rollout(self._robot.roles, self._robot.horizon)
        errors = judge(self.task, rollout)
        nan = math.nan
        row = MetricsRow(None, bag_number(bag), errors.rmse, errors.mse, nan, nan, 0.0, 0.0, 0.0)
        self.directory.append_metrics(row)
        return row

    def _iteration(self, index: int, progress: Callable[[Progress], None] | None) -> Iteration:
        """Return the iteration, from its file if it has been learned already."""
        if index in self.directory.iterations():
            return self.directory.read_iteration(index)
        previous = self.directory.read_iteration(index - 1) if index > 1 else None
        iteration = learn(self.task, self._settings, self._rollouts(), previous, progress)
        parameters = controller_parameters(self.task, iteration.policy, self._robot)
        self.directory.write_iteration(iteration, self._robot.roles, self._alone(parameters))
        return iteration

    def _alone(self, parameters: dict[str, Any]) -> dict[str, Any]:
        """Return what a policy file holds beside the policy, to run it without anything else."""
        start = {"start_position": parameters["start_position"]}
        robot = {
            name: value
            for name, value in values_of(self._robot).items()
            if value != ()  # an empty list in a parameter file has no type
        }
        return {**robot, **start}

    def _rollouts(self) -> list[Rollout]:
        """Return the trials that have been judged, in order."""
        return [
            read_bag(self.directory.trials_directory / f"{row.trial:03d}").rollout(
                self._robot.roles, self._robot.horizon
            )
            for row in self.directory.metrics()
        ]

    def _judge_the_unjudged(self) -> None:
        """Write the rows of trials that were recorded before somebody was killed."""
        trials = self.directory.trials(self._robot.roles, self._robot.horizon)
        learned = self.directory.iterations()
        while (trial := trials.get(self.next_index)) is not None:
            index = self.next_index
            iteration = self.directory.read_iteration(index) if index in learned else None
            self.directory.append_metrics(self._row(index, iteration, trial.number, trial.rollout))

    def _row(
        self, index: int, iteration: Iteration | None, trial: int, rollout: Rollout
    ) -> MetricsRow:
        errors = judge(self.task, rollout)
        _, margin = weigh(self.task, self._settings, [*self._rollouts(), rollout])
        return MetricsRow(
            iteration=index,
            trial=trial,
            rmse_rad=errors.rmse,
            mse=errors.mse,
            margin=margin,
            cost=iteration.cost if iteration else math.nan,
            robot_time_s=(index + 1) * self.task.horizon * self.task.dt,
            model_s=iteration.model_seconds if iteration else 0.0,
            policy_s=iteration.policy_seconds if iteration else 0.0,
        )
