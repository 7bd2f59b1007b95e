"""A look at a robot from outside: what it tells, who commands it, and a nudge."""

from __future__ import annotations

import time
from collections.abc import Iterable

from rclpy.clock import Clock, ClockType
from rosgraph_msgs.msg import Clock as TimeMessage
from sensor_msgs.msg import JointState

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.finding import Finding
from irlpilco_ros.control.joint_state_check import Arrival, check_joint_states
from irlpilco_ros.control.motion_control import MotionControl, MotionRefusedError, Outcome
from irlpilco_ros.control.motions import Command
from irlpilco_ros.control.nudge import Nudge
from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.ros.command_output import CommandOutput
from irlpilco_ros.ros.command_topics import (
    ALL_OUTPUTS,
    JOINT_COMMAND_TOPIC,
    command_topics,
    moving_topics,
)
from irlpilco_ros.ros.endpoint_names import short_name
from irlpilco_ros.ros.messages import clock_time
from irlpilco_ros.ros.qos import CLOCK, STATE_RECORDING
from irlpilco_ros.ros.receivers import receivers
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.session import POLL, Session

_WATCH = 0.01  # [s] between two looks whether the robot still tells


class RobotWatch:
    """Listens to a robot."""

    def __init__(
        self, session: Session, robot: RobotSettings, settings: ControllerSettings, moves: bool
    ) -> None:
        """Begin to listen.

        Args:
            session: A node to listen with.
            robot: The robot.
            settings: Those of its controller.
            moves: Whether it will be nudged.
        """
        self._session, self._robot, self._settings = session, robot, settings
        self._heard: list[Arrival] = []
        self._clock: float | None = None
        self._control = MotionControl(robot, settings)
        self._nudge: Nudge | None = None
        node = session.node
        self._output = (
            CommandOutput(
                node,
                robot.roles.commanded,
                robot.command_interface,
                settings,
                self._stop,
            )
            if moves
            else None
        )
        self._states = SafeSubscription(
            node, JointState, "joint_states", self._take, STATE_RECORDING
        )
        self._times = SafeSubscription(node, TimeMessage, "/clock", self._take_time, CLOCK)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_WATCH, self._watch, clock=steady)

    def listen(self, seconds: float) -> Iterable[Finding]:
        """Listen for a time [s], and say what is right and what is not."""
        self._session.run(self._session.clients.sleep(seconds))
        if self._states.refused:
            yield Finding(False, f"messages: {self._states.refused} unusable, {self._states.fault}")
        yield from check_joint_states(self._robot, self._settings, self._heard, seconds)
        yield from self._commanders()
        yield self._receivers()

    def nudge(self) -> Iterable[Finding]:
        """Move each joint by a hundredth of a radian, and say what came of it; the robot moves."""
        assert self._output is not None  # it was said that it will be moved
        hindrance = self._output.others() or self._output.unheard()
        if hindrance:
            yield Finding(False, f"nudge: not moved, {hindrance}")
            return
        nudge, outcomes = Nudge(self._robot, tries_timeout=self._clock is None), list[Outcome]()
        try:
            self._control.start(nudge, time.monotonic(), outcomes.append)
        except MotionRefusedError as error:
            yield Finding(False, f"nudge: not moved, {error}")
            return
        self._nudge = nudge
        try:
            while not outcomes:
                self._session.run(self._session.clients.sleep(POLL))
        finally:  # Ctrl-C, too, leaves a robot that stands
            self._nudge = None
            self._send(self._control.stop("it was interrupted") or self._control.zero())
            self._output.finish()
        if not outcomes[0].succeeded:
            yield Finding(False, outcomes[0].message)
            return
        yield from nudge.findings(self._settings.approach_delay)

    def _take(self, data: bytes, info: Info) -> None:
        message = decode(data)
        if self._nudge is None:
            came = info["received_timestamp"] * 1e-9
            self._heard.append(Arrival(came, message, self._clock))
        elif self._output is not None:
            self._output.listen()
        self._send(self._control.take(message, time.monotonic()))

    def _take_time(self, data: bytes, _: Info) -> None:
        now = clock_time(data)
        self._clock = now * 1e-9
        self._control.note_clock(now)

    def _watch(self) -> None:
        if self._nudge is not None:
            self._times.drain()
            self._states.drain()
            self._send(self._control.watch(time.monotonic()))

    def _stop(self, reason: str) -> None:
        self._send(self._control.stop(reason))

    def _send(self, command: Command | None) -> None:
        is_withheld = self._control.motion is not None and self._nudge and self._nudge.withheld
        if command is not None and self._output is not None and not is_withheld:
            self._output.send(command, self._control.commanded_positions)

    def _commanders(self) -> Iterable[Finding]:
        for topic in command_topics(ALL_OUTPUTS):
            node = self._session.node
            found = node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
            names = {short_name(endpoint) for endpoint in found} - {node.get_name()}
            strangers = sorted(names - {"controller"})
            if strangers:
                yield Finding(
                    False,
                    f"commands: {topic} is published by {', '.join(strangers)}; nobody but the "
                    "controller may (what was killed is forgotten after 20 s)",
                )
            elif topic == JOINT_COMMAND_TOPIC:
                who = "the controller alone" if names else "nobody yet"
                yield Finding(True, f"commands: {who} on {topic}")

    def _receivers(self) -> Finding:
        hearing = receivers(self._session.node, self._settings)
        if hearing:
            return Finding(True, f"receiver: {', '.join(sorted(hearing))}")
        return Finding(
            False,
            f"receiver: nobody listens on {' or '.join(moving_topics(self._settings))}; what is "
            "to move the robot by it (a driver, a bridge, or ros2_control with "
            "velocity_controller_output or joint_trajectory_output: true)?",
        )
