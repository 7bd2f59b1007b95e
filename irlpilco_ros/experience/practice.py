"""What is practised at a place, and what is expected of a policy there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from irlpilco_ros.experience.path_judge import PathJudge
from irlpilco_ros.experience.places import Place
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.shown_motion import ShownMotion
from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.task import Task


def task_of_motions(
    shown: Sequence[ShownMotion],
    robot: RobotSettings,
    speed: float = 1.0,
    move: Array | None = None,
) -> Task:
    """Return the learning problem that checked demonstrations pose to a robot.

    Args:
        shown: The demonstrations.
        robot: The robot.
        speed: How many times as fast they are as they were shown.
        move: How the object has moved since then (4, 4); None if it has not.
    """
    return Task(
        tuple(each.rollout for each in shown),
        robot.control_period,
        robot.control_limit,
        robot.feature_map if move is None else robot.feature_map.where_moved(move),
        position_noise=robot.position_noise,
        velocity_noise=robot.velocity_noise,
        layout=robot.roles.layout,
        start_spread=robot.start_spread,
        speed=speed,
    )


@dataclass(frozen=True)
class Practice:
    """What is practised at a place.

    Attributes:
        task: The learning problem; the very same where pose of the object and speed are the same.
        motions: What is imitated.
        paths: What measures trials over their whole path.
        place: Where the object is; None for where it was shown.
    """

    task: Task
    motions: tuple[ShownMotion, ...]
    paths: PathJudge
    place: Place | None = None

    @classmethod
    def shown(
        cls, directory: RunDirectory, robot: RobotSettings, motions: tuple[ShownMotion, ...]
    ) -> Self:
        """Return the practice where it was shown."""
        task = task_of_motions(motions, robot)
        return cls(task, motions, PathJudge(directory, robot.roles, motions, _seconds(task)))

    @classmethod
    def carried(
        cls, directory: RunDirectory, robot: RobotSettings, place: Place, others: Sequence[Self]
    ) -> Self:
        """Return the practice at another place, which may be one of others again.

        Args:
            directory: The run.
            robot: The robot.
            place: With nothing shown, if it is the place of the first of the others.
            others: All before it, that where it was shown first.
        """
        if not place.shown:
            return cls(others[0].task, others[0].motions, others[0].paths, place)
        for other in others:
            if other.is_at(place.object_pose, place.speed):
                return cls(other.task, other.motions, other.paths, place)
        task = task_of_motions(place.shown, robot, place.speed, place.move)
        paths = PathJudge(directory, robot.roles, place.shown, _seconds(task), carried=True)
        return cls(task, place.shown, paths, place)

    @property
    def first(self) -> int:
        """Iteration that was the first for it."""
        return 0 if self.place is None else self.place.first

    def is_at(self, object_pose: Array | None, speed: float) -> bool:
        """Whether it is known to be where the object is in this pose (4, 4), and so fast."""
        return self.place is not None and self.place.is_at(object_pose, speed)


def _seconds(task: Task) -> float:
    return task.horizon * task.dt


@dataclass(frozen=True)
class Plan:
    """The trial that comes next.

    Attributes:
        iteration: What was learned for it, and the policy that the robot is to try.
        parameters: What the controller needs for it: policy, start position [rad], and what is
            predicted of it.
    """

    iteration: Iteration
    parameters: dict[str, Any]


@dataclass(frozen=True)
class Forecast:
    """How far off a policy is expected to be, over joints and steps t = 1..H.

    Attributes:
        error: RMS of the predicted distance to what was shown [rad]; NaN without a prediction.
        spread: RMS of the predicted standard deviation [rad].
    """

    error: float
    spread: float

    @classmethod
    def of(cls, task: Task, iteration: Iteration, joints: int) -> Self:
        """Return what an iteration predicts of its first `joints` states."""
        if not iteration.predicted_means.size:
            return cls(math.nan, math.nan)
        off = iteration.predicted_means - task.reference_states()
        variances = np.diagonal(iteration.predicted_covariances, axis1=1, axis2=2)
        error, spread = (float(np.sqrt(np.mean(each[1:, :joints]))) for each in (off**2, variances))
        return cls(error, spread)

    @property
    def total(self) -> float:
        """RMS error that is to be expected, what is not known included [rad]."""
        return math.hypot(self.error, self.spread)

    def check(self, limit: float) -> None:
        """Refuse what is expected to be farther off than a limit [rad].

        Raises:
            UnreachableError: says how far off it is expected to be.
        """
        if self.total > limit:
            raise UnreachableError(
                f"the model does not vouch for a policy there: predicted {self.sentence()}, more "
                f"than adapt_error_limit, {limit:g} rad; try places in between, or raise the limit"
            )

    def sentence(self) -> str:
        """Return it in words."""
        if math.isnan(self.error):
            return "nothing is predicted before the first trial"
        return f"{self.error:.4f} rad off, give or take {self.spread:.4f}"


@dataclass(frozen=True)
class Adapted:
    """A policy for where the object is now.

    Attributes:
        number: Of the place; 0 is where it was shown.
        plan: The trial that comes next.
        forecast: What is expected of it.
    """

    number: int
    plan: Plan
    forecast: Forecast
