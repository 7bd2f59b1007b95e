"""Node `controller`: runs the policy on the robot, and stops the robot for good reason.

A thin shell around `motion_control.MotionControl`. Interfaces: docs in msgs_docs/.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.parameter import Parameter
from rclpy.task import Future
from rosgraph_msgs.msg import Clock as TimeMessage
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from irlpilco_ros.control.approach import Approach
from irlpilco_ros.control.band_guard import BandGuard
from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motion_control import MotionControl, MotionRefusedError, Outcome
from irlpilco_ros.control.motions import Command, Motion, Trial
from irlpilco_ros.control.safety import check_start
from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.ros.clients import Clients
from irlpilco_ros.ros.command_output import CommandOutput
from irlpilco_ros.ros.health import ERROR, OK, WARN, Health
from irlpilco_ros.ros.messages import clock_time
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.policy_parameters import PolicyParameters
from irlpilco_ros.ros.qos import CLOCK, JOINT_COMMAND, JOINT_STATES_PUB, JOINT_STATES_SUB
from irlpilco_ros.ros.reference_output import ReferenceOutput
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.suite_node import SuiteNode

PATIENCE = 1.0
"""How long a motion waits for joint states, and for somebody who hears its commands [s]."""

WATCH_PERIOD = 0.01
"""How often silence of the joint states is looked for [s]."""


class Controller(SuiteNode):
    """Answers every new joint state with a command while a motion is going on."""

    def __init__(self) -> None:
        """Declare parameters, offer services, listen to joint states."""
        super().__init__("controller")
        self._robot = declare_settings(self, RobotSettings)
        for doubt in self._robot.doubts():
            self.get_logger().warning(doubt)
        settings = declare_settings(
            self, ControllerSettings, apply=self._apply_settings, check=self._check_settings
        )
        self._control = MotionControl(self._robot, settings)
        self._policy = PolicyParameters(self, self._robot, self._policy_changed)
        self._fault = ""
        self._stranger = ""
        self._others = ""
        self._output = CommandOutput(
            self,
            self._robot.roles.commanded,
            self._robot.command_interface,
            settings,
            self._hear_stranger,
        )
        self._reference = ReferenceOutput(
            self.create_publisher(JointState, "~/reference", JOINT_STATES_PUB), self._robot.joints
        )
        if settings.guide_topic:
            self._guides = SafeSubscription(
                self, JointState, settings.guide_topic, self._hear_guide, JOINT_COMMAND
            )
        self._health = Health(self)
        self._calls = Clients(self)
        self._offer_services()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(WATCH_PERIOD, self._watch, clock=steady)
        self.create_timer(1.0, self._tell, clock=steady)
        if settings.command_rate > 0.0:
            self.create_timer(1.0 / settings.command_rate, self._repeat, clock=steady)
        self._states = SafeSubscription(
            self, JointState, "joint_states", self._take, JOINT_STATES_SUB
        )
        self._times = SafeSubscription(self, TimeMessage, "/clock", self._take_time, CLOCK)
        self.get_logger().info(self._first_words())
        self._tell()

    def wind_down(self) -> None:
        """Break off what is going on, so that whoever waits for it gets an answer."""
        self._send(self._control.stop("the controller was told to end (SIGINT or SIGTERM)"))

    def shutdown(self) -> None:
        """Send zero velocity as the last message, if anything was ever sent."""
        if self._output.last is not None:
            self._send(self._control.zero())
            self._output.finish()

    def _first_words(self) -> str:
        joints = len(self._robot.roles.commanded)
        kinds = {"velocity": "velocities", "effort": "efforts"}
        commands = kinds[self._robot.command_interface]
        policy = self._policy.policy
        known = "waiting for a policy" if policy is None else f"policy {policy.kind}"
        allowed = "" if self._control.settings.enabled else "; disabled (controller/enable)"
        return f"ready to move {joints} joints by {commands}; {known}{allowed}"

    def _offer_services(self) -> None:
        # Motions await their end inside the callback; the others must run meanwhile.
        group = ReentrantCallbackGroup()
        self.create_service(Trigger, "~/run_trial", self._run_trial, callback_group=group)
        self.create_service(Trigger, "~/move_to_start", self._move_to_start, callback_group=group)
        self.create_service(Trigger, "~/stop", self._stop, callback_group=group)
        self.create_service(SetBool, "~/enable", self._enable, callback_group=group)

    def _take(self, data: bytes, _info: Info) -> None:
        self._output.listen()  # a trial that somebody else disturbed must not end well
        self._send(self._control.take(decode(data), time.monotonic()))
        self._reference.tell()  # after the command, which must not wait for it

    def _take_time(self, data: bytes, _info: Info) -> None:
        self._control.note_clock(clock_time(data))

    def _watch(self) -> None:
        # What has come while this process was busy is no silence.
        self._times.drain()
        self._states.drain()
        self._send(self._control.watch(time.monotonic()))

    def _repeat(self) -> None:
        if self._control.motion is not None and not self._control.silence(time.monotonic()):
            self._send(self._control.last)

    def _send(self, command: Command | None) -> None:
        if command is not None:
            self._output.send(command, self._control.commanded_positions)

    def _hear_stranger(self, what: str) -> None:
        self._stranger = what
        others = self._output.others()
        self._send(self._control.stop(f"{what}; {others}" if others else what))

    def _hear_guide(self, _data: bytes, _info: Info) -> None:
        topic = self._control.settings.guide_topic
        self._hear_stranger(f"somebody guides the robot by hand, on {topic}")

    async def _run_trial(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        await self._listen()
        policy = self._policy.policy
        if policy is None:
            return self._refuse(response, "there is no policy; set the parameters policy.* first")
        try:
            self._control.check_start()
        except MotionRefusedError as error:
            return self._refuse(response, str(error))
        robot = self._robot
        horizon = self._control.settings.trial_horizon or robot.horizon
        if not horizon:
            return self._refuse(
                response,
                "it is not known how many decisions a trial has; set the parameter trial_horizon, "
                "as the learner does with its policies",
            )
        try:
            guard = self._guard_of_trial(horizon)
        except MotionRefusedError as error:
            return self._refuse(response, str(error))
        period = self._control.settings.trial_control_period or robot.control_period
        self._reference.begin(self._policy.demonstrated)
        acting = PolicyOf(robot.roles, policy)
        trial = Trial(acting, horizon, period, guard, self._reference.note)
        return await self._move(trial, response)

    def _guard_of_trial(self, horizon: int) -> BandGuard | None:
        """Return what watches a trial; None if nobody asks for it, or nothing was predicted.

        Raises:
            MotionRefusedError: what was predicted is a trial of another length.
        """
        sigma, band = self._control.settings.guard_sigma, self._policy.band
        if not sigma:
            return None
        if band is None:
            self.get_logger().warning(
                "nothing was predicted of this policy's trial: guard_sigma does not watch it"
            )
            return None
        if band.horizon != horizon:
            raise MotionRefusedError(
                f"the trial has {horizon} decisions, but {band.horizon} were predicted "
                "(policy.predicted_positions): guard_sigma cannot watch it; set it to 0, or "
                "trial_horizon with the policy"
            )
        return BandGuard(self._robot.roles, band, sigma)

    async def _move_to_start(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        await self._listen()
        settings = self._control.settings
        if not settings.start_position:
            return self._refuse(
                response, "there is no start; set the parameter start_position first"
            )
        if self._robot.command_interface != "velocity":
            return self._refuse(response, "move_to_start needs a robot that takes velocities")
        start = np.array(settings.start_position)
        approach = Approach(self._robot.joints, start, self._robot.control_limit, settings)
        return await self._move(approach, response)

    async def _listen(self) -> None:
        """Wait a moment for the robot if it lacks: one look at a busy computer tells little."""
        end = time.monotonic() + PATIENCE
        while self._control.motion is None and time.monotonic() < end:
            if not self._control.silence(time.monotonic()) and self._output.is_heard:
                return
            await self._calls.sleep(WATCH_PERIOD)

    async def _move(self, motion: Motion, response: Trigger.Response) -> Trigger.Response:
        """Run a motion to its end and answer how it ended."""
        hindrance = self._hindrance()
        if hindrance:
            return self._refuse(response, hindrance)
        over = Future(executor=self.executor)
        self._stranger = ""
        try:
            self._control.start(motion, time.monotonic(), over.set_result)
        except MotionRefusedError as error:
            return self._refuse(response, str(error))
        self._fault = ""
        self.get_logger().info(f"{motion.name} begins")
        self._tell()
        outcome: Outcome = await over
        self._output.listen()
        if outcome.succeeded and self._stranger:
            outcome = Outcome(False, f"{motion.name} does not count: {self._stranger}")
        self._fault = "" if outcome.succeeded else outcome.message
        self._tell()
        if outcome.succeeded:
            self.get_logger().info(outcome.message)
        else:
            self.get_logger().error(outcome.message)
        response.success, response.message = outcome.succeeded, outcome.message
        return response

    def _refuse(self, response: Trigger.Response, reason: str) -> Trigger.Response:
        self.get_logger().warning(f"refused: {reason}")
        response.success, response.message = False, reason
        return response

    def _hindrance(self) -> str:
        """Say what of the robot's surroundings keeps a motion from starting; empty if nothing."""
        others = self._output.others()
        if others or self._control.silence(time.monotonic()):
            return others  # a robot that tells nothing may not be there: the motion says so
        return self._output.unheard()

    def _stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        motion = self._control.motion
        self._send(self._control.stop("controller/stop was called"))
        response.success = True
        response.message = "nothing was moving" if motion is None else f"{motion.name} stopped"
        return response

    def _enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self.set_parameters([Parameter("enabled", value=bool(request.data))])
        response.success, response.message = True, "enabled" if request.data else "disabled"
        return response

    def _policy_changed(self, policy: Policy | None) -> None:
        self._send(self._control.stop("the policy was changed"))
        words = "the policy was taken away" if policy is None else f"new policy: {policy.kind}"
        self.get_logger().info(words)
        self._tell()

    def _check_settings(self, settings: ControllerSettings) -> None:
        check_start(self._robot, settings.start_position, settings.position_margin)

    def _apply_settings(self, settings: ControllerSettings) -> None:
        was_enabled = self._control.settings.enabled
        self._send(self._control.change(settings))
        if settings.enabled != was_enabled:
            self.get_logger().info("enabled" if settings.enabled else "disabled")
        self._tell()

    def _tell(self) -> None:
        """Report the state of the controller on /diagnostics."""
        control, policy = self._control, self._policy.policy
        before, self._others = self._others, self._output.others()
        if self._others and self._others != before:
            self.get_logger().warning(self._others)
        silence = control.silence(time.monotonic())
        unheard = self._output.unheard()
        if control.motion is not None:
            level, message = OK, f"{control.motion.name} is going on"
        elif self._fault:
            level, message = ERROR, self._fault
            if self._others and self._others not in message:
                message += f"; {self._others}"
        elif not control.settings.enabled:
            level, message = WARN, "disabled"
        elif self._others:
            level, message = WARN, self._others
        elif silence:
            level, message = WARN, silence
        elif unheard:
            level, message = WARN, unheard
        elif control.settings.position_margin < 0.0:
            margin = control.settings.position_margin
            level, message = WARN, f"position limits are not guarded (position_margin {margin:g})"
        else:
            level, message = OK, "idle"
        kind = "none" if policy is None else policy.kind
        self._health.report(level, message, enabled=control.settings.enabled, policy=kind)


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    return run_node(Controller)


if __name__ == "__main__":
    sys.exit(main())
