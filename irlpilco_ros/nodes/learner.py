"""The learner: `learn_iteration` is one pass of Algorithm 3 on the robot.

It computes in a thread of its own and awaits the robot, so that it answers, reports progress and
stops at once, whatever it is doing. What it has done is in the run directory only.
"""

from __future__ import annotations

import dataclasses
import math
import sys
import time
import traceback
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from irlpilco_ros.experience.adapting import Adapter, AdaptSettings
from irlpilco_ros.experience.apprenticeship import (
    Apprenticeship,
    TrialReport,
    check_demonstration,
)
from irlpilco_ros.experience.errors import BagError, UnfitDemonstrationError
from irlpilco_ros.experience.object_pose import ObjectSettings
from irlpilco_ros.experience.practice import Plan
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.rigid_motion import mean_pose
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.errors import InvalidSettingError, IrlPilcoError
from irlpilco_ros.learning.iteration import Progress
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.ros.clients import Clients, ServiceError
from irlpilco_ros.ros.description_watch import DescriptionWatch
from irlpilco_ros.ros.health import OK, WARN, Health
from irlpilco_ros.ros.learner_progress import IterationClock, LearnerProgress
from irlpilco_ros.ros.learner_worker import LearnerWorker
from irlpilco_ros.ros.object_watch import ObjectWatch
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.predicted_trajectory import predicted_trajectory
from irlpilco_ros.ros.progress_numbers import ProgressNumbers
from irlpilco_ros.ros.qos import DIAGNOSTICS, LATCHED
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.suite_node import SuiteNode
from irlpilco_ros.ros.trial_runner import TrialRunner
from irlpilco_ros.ros.undertaking import Undertaking

Result = TypeVar("Result")

PROGRESS_PERIOD = 0.25
"""Time between two messages on learner/progress [s]."""

COMPUTED = 0.8
"""Fraction of an iteration that is done when the computing is over."""

ROBOT_STAGES = {"hand over": COMPUTED, "move to start": 0.82, "trial": 0.9, "judge": 0.98}
"""Fraction of an iteration that is done when a stage on the robot begins."""

STAGE_WORDS = {
    "model": "training the model of the robot",
    "policy": "searching the policy",
    "move to start": "the robot goes to the start",
    "trial": "the robot tries the policy",
}
"""Stages that are worth a line in the log, and how it says them."""

STOP_TIMEOUT = 5.0
"""How long a computation may take to notice that the node stops [s]."""

CANCEL_TIMEOUT = 20.0
"""How long an iteration may take to end that is cancelled [s]; what is being judged is judged."""

CANCEL_POLL = 0.2
"""Time between two calls of controller/stop meanwhile [s]: the first may come before the motion."""

FIRST_POSE_TIMEOUT = 2.0
"""How long to wait for the object's first pose where somebody publishes one [s].

A call of adapt may overtake a pose that was sent before it.
"""

FIRST_POSE_POLL = 0.05
"""Time between two looks for it [s]."""


@dataclass(frozen=True)
class RunSettings:
    """Where the learner works."""

    run_directory: str = setting(
        "runs/sweep",
        "Folder that holds all of this run: a run that is there goes on, else one begins.",
        read_only=True,
    )
    demonstration: str = setting(
        "",
        "Bag of the demonstration, or folder of several bags NNN that show the same task; empty "
        "if the run directory has it already.",
    )
    joint_states_topic: str = setting(
        "",
        "Topic of joint states to take of bags where several tell the same joints; empty if there "
        "is none to choose.",
    )
    demonstration_window: tuple[float, ...] = setting(
        (),
        "Begin and end of the part of the demonstration that is imitated, since its first sample; "
        "empty: its motion, without what stands still before and after it.",
        unit="s",
    )

    def __post_init__(self) -> None:
        check(self)


class Learner(SuiteNode):
    """The node `learner`."""

    def __init__(self) -> None:
        """Declare the parameters and take up the run, if there is one.

        Raises:
            InvalidSettingError: a parameter is wrong.
            RunDirectoryError: the run directory belongs to another demonstration or configuration.
        """
        super().__init__("learner")
        self._robot = declare_settings(self, RobotSettings)
        for doubt in self._robot.doubts():
            self.get_logger().warning(doubt)
        self._settings = declare_settings(self, LearningSettings)
        self._tools = declare_settings(self, ToolSettings)
        self._accepted = declare_settings(self, AdaptSettings, apply=self._accept)
        self._object = declare_settings(self, ObjectSettings, apply=self._place_object)
        self._objects = ObjectWatch(self)
        self._description = None if self._tools.urdf else DescriptionWatch(self)
        self._where = declare_settings(
            self, RunSettings, apply=self._move, check=self._check_demonstration
        )
        self._run: Apprenticeship | None = None
        self._told: tuple[str, ...] = ()
        self._chosen_anew = False  # by somebody who set parameters since the start
        self._under_way: Undertaking | None = None
        self._progress = LearnerProgress()
        self._error = math.nan  # of the latest trial [rad]
        self._iteration_clock = IterationClock()
        self._calls = Clients(self)
        self._trials = TrialRunner(self._calls, self._robot.reset_service)
        self._worker = LearnerWorker(lambda: self.executor)
        self._health = Health(self)
        self._progress_publisher = self.create_publisher(
            DiagnosticArray, "learner/progress", DIAGNOSTICS
        )
        self._numbers = ProgressNumbers(self)
        self._prediction_publisher = self.create_publisher(
            JointTrajectory, "learner/predicted_trajectory", LATCHED
        )
        group = ReentrantCallbackGroup()
        self.create_timer(
            PROGRESS_PERIOD,
            self._publish_progress,
            callback_group=group,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )
        self.create_service(Trigger, "learn_iteration", self._learn_iteration, callback_group=group)
        self.create_service(Trigger, "~/adapt", self._adapt, callback_group=group)
        self.create_service(Trigger, "~/cancel", self._cancel, callback_group=group)
        words = self._first_words()
        self.get_logger().info(f"{words}; run directory {self._where.run_directory}")
        self._health.report(OK, words)

    def shutdown(self) -> None:
        """Break off whatever is being computed; the run directory stays as it is."""
        if not self._worker.cancel(STOP_TIMEOUT):
            self.get_logger().error(f"still computing after {STOP_TIMEOUT} s; leaving it")
        self._close()

    def _check_demonstration(self, where: RunSettings) -> None:
        """Refuse what cannot be imitated before it is copied; a run that has learned keeps its own.

        Raises:
            InvalidSettingError: says what is wrong with the demonstration.
        """
        if not where.demonstration:
            return
        try:
            check_demonstration(
                RunDirectory(where.run_directory),
                Path(where.demonstration),
                self._robot,
                where.joint_states_topic,
                where.demonstration_window,
            )
        except IrlPilcoError as error:
            raise InvalidSettingError(str(error)) from error

    def _move(self, where: RunSettings) -> None:
        before, self._where = self._where, where
        self._chosen_anew = True
        if where.demonstration and where.demonstration != before.demonstration:
            self.get_logger().info(f"ready to learn from {where.demonstration}")

    def _first_words(self) -> str:
        """Check the run at the start, so that a wrong one is refused before the robot moves."""
        recorded = RunDirectory(self._where.run_directory).demonstration_directory
        if not self._where.demonstration and not recorded.exists():
            return "waiting for a demonstration"
        try:
            return f"ready for iteration {self._open().next_index}"
        except UnfitDemonstrationError as error:
            if self._where.demonstration or RunDirectory(self._where.run_directory).has_learned():
                raise
            self.get_logger().warning(f"{error}; set the parameter demonstration to another one")
            return f"waiting for another demonstration: {error}"
        except RobotDescriptionError as error:
            if self._tools.urdf:
                raise
            return f"waiting for robot_description: {error}"

    def _open(self) -> Apprenticeship:
        """Read where the run stands, with the parameters as they are now."""
        self._close()
        robot = dataclasses.replace(self._robot, tools=self._tools, description=self._told_urdf)
        self._run = Apprenticeship.open(
            Path(self._where.run_directory),
            Path(self._where.demonstration) if self._where.demonstration else None,
            robot,
            self._settings,
            self._where.joint_states_topic,
            self._where.demonstration_window,
            replace=self._chosen_anew,
        )
        self._error = self._run.latest_error
        about = tuple(self._run.about_demonstration())
        for line in about:
            if line not in self._told:
                self.get_logger().info(line)
        for note in self._run.notes:
            if note not in self._told:
                self.get_logger().warning(note)
        self._told = about + self._run.notes
        return self._run

    def _close(self) -> None:
        if self._run is not None:
            self._run.close()
            self._run = None

    def _accept(self, settings: AdaptSettings) -> None:
        self._accepted = settings

    def _place_object(self, settings: ObjectSettings) -> None:
        self._object = settings

    async def _learn_iteration(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Do one iteration."""
        return await self._serve(response, "learning", "the last iteration", self._iterate)

    async def _adapt(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Carry the run over to where the object is now, and to the speed that is set."""
        return await self._serve(response, "adapting", "adapting", self._carry_over)

    async def _cancel(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """End what is under way: the robot stops, and the run is as it was."""
        mine, was = self._under_way, self._progress
        if mine is None:
            response.message = "nothing is under way"
            return response
        mine.cancelled, end = True, time.monotonic() + CANCEL_TIMEOUT
        while self._under_way is mine and time.monotonic() < end:
            if self._progress.stage in ROBOT_STAGES:
                with suppress(ServiceError):  # told by the iteration, which needs it as well
                    await self._trials.halt()
            await self._calls.sleep(CANCEL_POLL)
        response.success = self._under_way is not mine and not mine.done
        if response.success:
            response.message = (
                f"iteration {was.iteration} was cancelled ({was.stage}); the run is as it was"
            )
        elif mine.done:
            response.message = f"too late: iteration {was.iteration} was done already"
        else:
            response.message = f"still busy after {CANCEL_TIMEOUT:g} s ({self._progress.stage})"
        return response

    async def _serve(
        self,
        response: Trigger.Response,
        doing: str,
        what: str,
        job: Callable[[], Coroutine[Any, Any, str]],
    ) -> Trigger.Response:
        """Do what a service asks for; never raises, for what fails here must not end the node."""
        if self._under_way is not None:
            now = self._progress
            response.message = f"busy: iteration {now.iteration} is under way ({now.stage})"
            return response
        mine = self._under_way = Undertaking()
        self._health.report(OK, doing)
        try:
            response.message = await job()
            response.success = mine.done = True
            self.get_logger().info(response.message)
            self._health.report(OK, "idle", last=response.message)
        except IrlPilcoError as error:
            response.message = str(error)
        except Exception as error:
            traceback.print_exc()
            response.message = f"unexpected {type(error).__name__}: {error}"
        finally:
            self._under_way = None
            self._progress = LearnerProgress()
        if not response.success:
            if mine.cancelled:
                response.message = f"cancelled: {response.message}"
            self._health.report(WARN, f"{what} failed: {response.message}")
            self.get_logger().error(response.message)
        return response

    async def _carry_over(self) -> str:
        """Find a policy for where the object is now, and hand it over; return a line about it.

        Where nobody tells that, it is where the run is for, and another speed is to be found.

        Raises:
            BagError: nobody has told where the object is, and the speed is that of the run.
            IrlPilcoError: the motion cannot be done there, or the controller refuses.
        """
        self._say("open run")
        seen = await self._first_seen()
        run = await self._compute(self._open)
        if seen is None and self._accepted.speed == run.speed:
            raise BagError(
                f"where the object is now is not known: no pose came on {self._objects.topic_name}"
                f"{'; ' + self._objects.fault if self._objects.fault else ''}; publish it, or set "
                "the learner's parameter object_pose"
            )
        where = None if seen is None else _always(mean_pose(seen))
        adapter = self._adapter
        self._show(LearnerProgress(stage="prepare", iteration=run.next_index))
        adapted, sentence = await self._compute(
            lambda: adapter.adapt(run, where, self._take_progress)
        )
        if adapted.plan.iteration.index > 0:
            self._publish_prediction(adapted.plan)
        self._say("hand over")
        await self._trials.hand_over(adapted.plan.parameters)
        return str(sentence)

    @property
    def _adapter(self) -> Adapter:
        if self._description is not None:
            self._description.catch_up()
        urdf = self._told_urdf
        return Adapter(self._robot, self._tools, self._object, self._accepted, urdf)

    @property
    def _told_urdf(self) -> str:
        """The robot's description as it was told on robot_description; "" if it was not."""
        return "" if self._description is None else self._description.text

    async def _first_seen(self) -> Array | None:
        """Return where the object is; a first pose that is under way is waited for."""
        steady_end = time.monotonic() + FIRST_POSE_TIMEOUT
        while (seen := self._seen()) is None and self._objects.is_told:
            if time.monotonic() > steady_end:
                break
            await self._calls.sleep(FIRST_POSE_POLL)
        return seen

    def _seen(self) -> Array | None:
        """Return where the object was last seen (n, 4, 4), or is said to be; None if unknown."""
        self._objects.catch_up()
        said = self._object.pose
        return self._objects.readings if said is None or self._objects.last else said[None]

    async def _iterate(self) -> str:
        """Do what Algorithm 3 does between two questions to the user; return one line about it.

        Raises:
            ObjectMovedError: the object is not where the policy would sweep.
            IrlPilcoError: something else went wrong.
        """
        self._say("open run")
        await self._trials.settle()
        run = await self._compute(self._open)
        seen = self._seen()
        if seen is not None:
            await self._compute(lambda: self._adapter.check_stayed(run, seen))
        if run.next_index == 0:
            first = await self._do_trial(run)
            self.get_logger().info(first.sentence())
        report = await self._do_trial(run)
        return report.sentence()

    async def _do_trial(self, run: Apprenticeship) -> TrialReport:
        """Learn from all trials so far, try it on the robot, and see how well it went."""
        self._show(LearnerProgress(stage="prepare", iteration=run.next_index))
        plan: Plan = await self._compute(lambda: run.prepare(self._take_progress))
        for note in plan.iteration.notes:
            self.get_logger().warning(f"iteration {plan.iteration.index}: {note}")
        if plan.iteration.index > 0:
            self._publish_prediction(plan)
        bag = await self._trials.run(plan.parameters, run.directory.trials_directory, self._say)
        self._say("judge")
        report: TrialReport = await self._compute(lambda: run.finish(bag))
        self._error = report.row.error_rad
        return report

    def _publish_prediction(self, plan: Plan) -> None:
        now = self.get_clock().now().to_msg()
        self._prediction_publisher.publish(predicted_trajectory(plan.iteration, self._robot, now))

    async def _compute(self, job: Callable[[], Result]) -> Result:
        """Run the job in the worker's thread."""
        result: Result = await self._worker.run(job)
        return result

    def _take_progress(self, progress: Progress) -> None:
        """Take note of what the worker says; called in its thread, ends it if it is to end."""
        self._worker.check()
        self._check_cancelled()
        iteration = self._progress.iteration
        self._show(
            LearnerProgress(
                stage=progress.stage,
                iteration=iteration,
                fraction=COMPUTED * progress.fraction,
                cost=progress.cost,
                evaluations=progress.evaluations,
                seconds_left=self._iteration_clock.seconds_left(iteration, progress.fraction),
            )
        )

    def _say(self, stage: str) -> None:
        """Take note of a stage on the robot; it does not begin if the iteration is cancelled."""
        if stage != "judge":  # the trial has been made: it counts
            self._check_cancelled()
        fraction = ROBOT_STAGES.get(stage, 0.0)
        self._show(LearnerProgress(stage, self._progress.iteration, fraction))

    def _show(self, progress: LearnerProgress) -> None:
        """Take note of where the iteration is, and tell at once when a stage begins."""
        before, self._progress = self._progress, progress
        if (progress.stage, progress.iteration) == (before.stage, before.iteration):
            return
        words = STAGE_WORDS.get(progress.stage)
        if words:
            self.get_logger().info(f"iteration {progress.iteration}: {words}")
        self._publish_progress()  # on a fast computer it may be over before the timer's next turn

    def _check_cancelled(self) -> None:
        if self._under_way is not None:
            self._under_way.check()

    def _publish_progress(self) -> None:
        progress = self._progress
        self._progress_publisher.publish(progress.to_message(self.get_clock().now().to_msg()))
        self._numbers.publish(progress, self._error)


def _always(now: Array) -> Callable[[Array], Array]:
    """Return what tells where the object is now, wherever it was."""
    return lambda before: now


def main() -> int:
    """Run the node until a signal ends it."""
    return run_node(Learner)


if __name__ == "__main__":
    sys.exit(main())
