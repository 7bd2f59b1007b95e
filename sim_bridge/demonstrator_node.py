"""Node `demonstrator`: guides the simulated arms through a motion, as a person would who teaches.

In simulation only; on a real robot a person moves the arms.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from irlpilco_ros.control.joint_state_tracker import JointReading, JointStateTracker
from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.ros.clients import Clients
from irlpilco_ros.ros.health import OK, WARN, Health
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.qos import JOINT_COMMAND, JOINT_STATES_SUB
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.suite_node import SuiteNode
from sim_bridge.guided_motion import GuidedMotion, MinimumJerk
from sim_bridge.motion_files import load_motion

GUIDE_TOPIC = "baxter_simulator/guide"
_LOST = 0.5  # [s] for which a state that was answered may be repeated before that counts as lost
_SETTLE = 0.25  # [s] that the hands stay at the end of a motion
_AT_START = 0.02  # [rad]
_FOLLOWED = 0.05  # [rad]
_DISCOVERY, _POLL = 3.0, 0.05  # [s] of wall time
_SILENCE = 5.0  # [s] of wall time without a new joint state that end a motion


@dataclass(frozen=True)
class DemonstratorSettings:
    """What the demonstrator shows and how fast it goes to the start."""

    motion_file: str = setting(
        "",
        "YAML file of the motion, or the name of one that comes with the package: sweep_by_hand, "
        "cornered_sweep; empty: sweep_by_hand.",
        read_only=True,
    )
    approach_speed: float = setting(
        0.4,
        "Speed of the fastest joint on the way to the start.",
        unit="rad/s",
        minimum=0.01,
        maximum=1.5,
        read_only=True,
    )

    def __post_init__(self) -> None:
        check(self)


@dataclass
class _Performance:
    """A motion under way; `begin` is the stamp of the state at which it began [ns]."""

    motion: GuidedMotion | MinimumJerk
    begin: int
    done: Future


class DemonstratorNode(SuiteNode):
    """Answers each joint state, at its stamp, with where the guiding hands are."""

    def __init__(self) -> None:
        """Read the motion and wait for calls.

        Raises:
            InvalidSettingError: a parameter or the motion's file makes no sense.
        """
        super().__init__("demonstrator")
        self._settings = declare_settings(self, DemonstratorSettings)
        path = self._settings.motion_file
        self._motion = load_motion(path) if path else load_motion()
        self._tracker = JointStateTracker(self._motion.joints)
        self._answered_stamp: int | None = None
        self._answered_at = 0.0
        self._last_news = 0.0
        self._requested: tuple[str, Future] | None = None
        self._performance: _Performance | None = None
        self._guide = self.create_publisher(JointState, GUIDE_TOPIC, JOINT_COMMAND)
        self._states = SafeSubscription(
            self, JointState, "joint_states", self._on_state, JOINT_STATES_SUB
        )
        group = ReentrantCallbackGroup()
        self.create_service(Trigger, "~/move_to_start", self._on_move, callback_group=group)
        self.create_service(Trigger, "~/play", self._on_play, callback_group=group)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(0.5, self._watch, clock=steady)
        self._calls = Clients(self)
        self._health = Health(self, "idle")
        joints, seconds = len(self._motion.joints), self._motion.duration
        self.get_logger().info(f"ready to show a motion of {joints} joints and {seconds:g} s")

    async def _on_move(
        self, _request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        return await self._perform("move_to_start", response)

    async def _on_play(
        self, _request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        return await self._perform("play", response)

    async def _perform(self, what: str, response: Trigger.Response) -> Trigger.Response:
        """Begin at the next joint state and answer when the motion is over."""
        response.success = False
        await self._find_listener()
        if self._requested is not None:
            response.message = f"busy: {self._requested[0]} is under way"
            return response
        if self._guide.get_subscription_count() == 0:
            response.message = (
                f"nobody listens to {self._guide.topic_name}: is baxter_simulator running? A real "
                "robot's arms are guided by hand, not by this node"
            )
            return response
        done = Future(executor=self.executor)
        self._last_news = time.monotonic()
        self._requested = (what, done)
        self._health.report(OK, what)
        self.get_logger().info(f"{what} begins")
        failure = await done
        self._requested = self._performance = None
        self._health.report(WARN if failure else OK, failure or "idle")
        response.success = not failure
        response.message = failure or f"{what} is done"
        if failure:
            self.get_logger().error(failure)
        else:
            self.get_logger().info(response.message)
        return response

    async def _find_listener(self) -> None:
        """Give a simulator that has just been started the time to be discovered."""
        for _ in range(round(_DISCOVERY / _POLL)):
            if self._guide.get_subscription_count() > 0:
                return
            await self._calls.sleep(_POLL)

    def _on_state(self, data: bytes, _info: Info) -> None:
        state = decode(data)
        self._tracker.update(state, time.monotonic())
        reading = self._tracker.reading()
        if reading is None or self._requested is None or self._requested[1].done():
            return
        if not set(state.names) & set(self._motion.joints):
            return
        # A waiting simulator repeats a state; it gets one answer, and another where that was lost:
        # a simulator that has just been started may not hear the first.
        now = time.monotonic()
        if state.stamp != self._answered_stamp:
            self._last_news = now
        elif now - self._answered_at < _LOST:
            return
        if self._performance is None:
            self._performance = self._begin(*self._requested, reading)
        if self._performance is not None:
            self._go_on(self._performance, reading)

    def _begin(self, what: str, done: Future, reading: JointReading) -> _Performance | None:
        start, _ = self._motion.at(0.0)
        if what == "move_to_start":
            approach = MinimumJerk.within_speed(
                reading.positions, start, self._settings.approach_speed
            )
            return _Performance(approach, reading.stamp, done)
        distance = reading.positions - start
        furthest = int(np.abs(distance).argmax())
        if abs(distance[furthest]) > _AT_START:
            done.set_result(
                f"{self._motion.joints[furthest]} is {abs(distance[furthest]):.3f} [rad] from the "
                f"start; expected at most {_AT_START} [rad]: call demonstrator/move_to_start first"
            )
            return None
        return _Performance(self._motion, reading.stamp, done)

    def _go_on(self, performance: _Performance, reading: JointReading) -> None:
        elapsed = (reading.stamp - performance.begin) * 1e-9
        positions, velocities = performance.motion.at(elapsed)
        message = JointState(
            name=list(self._motion.joints),
            position=positions.tolist(),
            velocity=velocities.tolist(),
        )
        message.header.stamp = time_message(reading.stamp)
        self._answered_stamp, self._answered_at = reading.stamp, time.monotonic()
        self._guide.publish(message)
        if elapsed >= performance.motion.duration + _SETTLE:
            performance.done.set_result(self._failure(positions, reading))

    def _failure(self, positions: np.ndarray, reading: JointReading) -> str:
        """Return why the motion failed, or nothing if the arms are where they were led."""
        distance = np.abs(reading.positions - positions)
        furthest = int(distance.argmax())
        if distance[furthest] <= _FOLLOWED:
            return ""
        return (
            f"{self._motion.joints[furthest]} did not follow: it is {distance[furthest]:.3f} [rad] "
            f"from where it was led, expected at most {_FOLLOWED} [rad]; is an arm blocked?"
        )

    def _watch(self) -> None:
        """End a motion when the robot has gone silent, and say what is missing."""
        if self._requested is None or self._requested[1].done():
            return
        if time.monotonic() - self._last_news < _SILENCE:
            return
        missing = ", ".join(self._tracker.missing())
        self._requested[1].set_result(
            f"no new joint_states for {_SILENCE:g} s"
            + (f"; never heard of {missing}" if missing else "")
            + "; is baxter_simulator running, and does nobody else command it?"
        )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(DemonstratorNode, argv)


if __name__ == "__main__":
    sys.exit(main())
