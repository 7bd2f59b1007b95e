"""What the nodes of all simulated robots share: joint states out, commands in, time, resets."""

from __future__ import annotations

import threading
import time
from array import array
from collections.abc import Callable
from typing import Protocol

from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, decode
from irlpilco_ros.ros.health import ERROR, OK, WARN, Health
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import CLOCK, JOINT_COMMAND, JOINT_STATES_PUB
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.suite_node import SuiteNode
from sim_bridge.errors import DivergedError, InvalidCommandError
from sim_bridge.pace_settings import PaceSettings
from sim_bridge.pacemaker import Pacemaker
from sim_bridge.sensor_reading import SensorReading

PERIOD = 10_000_000  # [ns] between two joint states
_REPEAT = 0.05  # [s] of wall time between repetitions of a state that nobody answered
_WARN_EVERY = 2.0  # [s]


class Simulation(Protocol):
    """A simulated robot that advances by 10 ms at a time."""

    @property
    def nanoseconds(self) -> int:
        """Simulated time since the last reset [ns]."""

    def step(self) -> None:
        """Advance by one period."""

    def read(self) -> SensorReading:
        """Return the present joint states."""

    def reset(self) -> None:
        """Put the robot back to where it begins; time is 0 again."""


class SimulatorNode(SuiteNode):
    """Publishes joint_states at 100 Hz of simulated time; obeys joint_command and ~/reset.

    A robot's own node sets `simulation`, says in `obey` what a command does and calls `start`.
    """

    def __init__(self, name: str) -> None:
        """Make the node; time begins to run with `start`."""
        super().__init__(name)
        self._changed = threading.Condition()
        self._answered = False
        self._broken = False
        self._rejected = 0
        self._stop = threading.Event()
        self._states = self.create_publisher(JointState, "joint_states", JOINT_STATES_PUB)
        self._health = Health(self, "running")

    def start(self, simulation: Simulation, pace: PaceSettings, fresh: str) -> None:
        """Listen to commands and let time run.

        Args:
            simulation: The robot.
            pace: How time passes.
            fresh: Where a reset puts the robot, in words.
        """
        self._simulation, self._pace, self._fresh = simulation, pace, fresh
        # Stamps go on over a reset, and none is 0, which ROS takes for "no time yet".
        self._offset = time.time_ns() if pace.wall_time else PERIOD
        self._clock_publisher = (
            None if pace.wall_time else self.create_publisher(Clock, "/clock", CLOCK)
        )
        self._commands = SafeSubscription(
            self, JointState, "joint_command", self._on_command, JOINT_COMMAND
        )
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.get_logger().info(f"ready: {pace.sentence()}")
        self._thread = threading.Thread(target=self._run, name="simulation")
        self._thread.start()

    def shutdown(self) -> None:
        """Stop time."""
        self._stop.set()
        with self._changed:
            self._changed.notify_all()
        self._thread.join()

    def obey(self, message: JointStateMessage) -> None:
        """Hand a command to the simulation.

        Raises:
            InvalidCommandError: it makes no sense to this robot.
        """
        raise NotImplementedError

    def stepped(self, count: int) -> None:
        """Do what a robot does besides, after each state but for the first; none by default."""

    def details(self) -> dict[str, object]:
        """Return what /diagnostics is to tell about this robot."""
        return {}

    def take(self, order: Callable[[], None]) -> None:
        """Give an order to the simulation; one that makes no sense has no effect but a warning."""
        with self._changed:
            try:
                order()
            except InvalidCommandError as error:
                self._rejected += 1
                self.get_logger().warning(str(error), throttle_duration_sec=_WARN_EVERY)
                return
            self._answered = True
            self._changed.notify_all()

    def stamp(self) -> int:
        """Return the time of now on the wire [ns]."""
        return self._offset + self._simulation.nanoseconds

    def publish(self, message: JointState) -> None:
        """Send a message on joint_states."""
        self._states.publish(message)

    def _run(self) -> None:
        pacemaker = Pacemaker(PERIOD * 1e-9, self._pace.real_time_factor, self._stop)
        count = 0
        while not self._stop.is_set():
            with self._changed:
                try:
                    self._simulation.step()
                except DivergedError as error:
                    self._stand_still(error)
                    continue
                self._answered = False
                self._publish_state()
            self.stepped(count)
            if count % 100 == 0:
                self._report(pacemaker.seconds_lost)
            count += 1
            if self._pace.lockstep:
                self._wait_for_answer()
            else:
                pacemaker.wait()

    def _stand_still(self, error: DivergedError) -> None:
        """Publish no states, which a controller notices, until somebody resets."""
        self.get_logger().error(f"{error} (service {self.get_name()}/reset)")
        self._health.report(ERROR, str(error))
        self._broken = True
        self._changed.wait_for(lambda: not self._broken or self._stop.is_set())

    def _wait_for_answer(self) -> None:
        """Let no time pass until somebody commands or guides; repeat the state meanwhile."""
        with self._changed:
            while not self._answered and not self._stop.is_set():
                if not self._changed.wait(_REPEAT):
                    self._publish_state()

    def _publish_state(self) -> None:
        reading = self._simulation.read()
        stamp = time_message(self._offset + reading.stamp)
        if self._clock_publisher is not None:
            self._clock_publisher.publish(Clock(clock=stamp))
        message = JointState(
            name=list(reading.names),
            position=array("d", reading.positions),
            velocity=array("d", reading.velocities),
            effort=array("d", reading.efforts),
        )
        message.header.stamp = stamp
        self.publish(message)

    def _on_command(self, data: bytes, _info: Info) -> None:
        message = decode(data)
        self.take(lambda: self.obey(message))

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self._changed:
            self._offset += self._simulation.nanoseconds + PERIOD
            self._simulation.reset()
            self._answered = self._broken = False
            self._changed.notify_all()
            self._publish_state()
        response.success = True
        response.message = self._fresh
        self.get_logger().info(f"reset: {self._fresh}")
        return response

    def _report(self, seconds_lost: float) -> None:
        is_late = seconds_lost > 0.0
        self._health.report(
            WARN if is_late else OK,
            "too slow for the real_time_factor" if is_late else "running",
            simulated_seconds=f"{self._simulation.nanoseconds * 1e-9:.2f}",
            seconds_behind=f"{seconds_lost:.2f}",
            rejected_commands=self._rejected,
            lockstep=self._pace.lockstep,
            **self.details(),
        )
