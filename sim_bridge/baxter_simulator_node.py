"""Node `baxter_simulator`: the simulated Baxter under the topic names of the real one."""

from __future__ import annotations

import sys
import threading
import time
from array import array
from collections.abc import Callable, Sequence

from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from irlpilco_ros.nodes.health import ERROR, OK, WARN, Health
from irlpilco_ros.nodes.messages import time_message
from irlpilco_ros.nodes.parameters import declare_settings
from irlpilco_ros.nodes.qos import CLOCK, JOINT_COMMAND, JOINT_STATES_PUB
from irlpilco_ros.nodes.runtime import run_node
from sim_bridge.baxter_simulation import INITIAL_POSE, PERIOD, BaxterSimulation
from sim_bridge.errors import DivergedError, InvalidCommandError
from sim_bridge.joints import GRIPPER_JOINTS
from sim_bridge.pacemaker import Pacemaker
from sim_bridge.simulation_settings import SimulationSettings
from sim_bridge.viewer import Viewer

_REPEAT = 0.05  # [s] of wall time between repetitions of a state that nobody answered
_GRIPPER_EVERY = 5  # states between two messages of each gripper
_WARN_EVERY = 2.0  # [s]


class BaxterSimulatorNode(Node):
    """Publishes joint_states at 100 Hz of simulated time; obeys joint_command and ~/guide."""

    def __init__(self) -> None:
        """Build the robot and let time run.

        Raises:
            InvalidSettingError: a parameter has no sensible value.
            RenderingError: a viewer is asked for where there is no display.
        """
        super().__init__("baxter_simulator")
        self._settings = declare_settings(self, SimulationSettings)
        self._simulation = BaxterSimulation(self._settings)
        self._viewer = Viewer(self._simulation) if self._settings.viewer else None
        # Stamps go on over a reset, and none is 0, which ROS takes for "no time yet".
        self._offset = time.time_ns() if self._settings.wall_time else PERIOD
        self._changed = threading.Condition()
        self._answered = False
        self._broken = False
        self._rejected = 0
        self._stop = threading.Event()
        self._states = self.create_publisher(JointState, "joint_states", JOINT_STATES_PUB)
        self._clock_publisher = (
            None if self._settings.wall_time else self.create_publisher(Clock, "/clock", CLOCK)
        )
        self.create_subscription(JointState, "joint_command", self._on_command, JOINT_COMMAND)
        self.create_subscription(JointState, "~/guide", self._on_guide, JOINT_COMMAND)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self._health = Health(self, "running")
        self._thread = threading.Thread(target=self._run, name="simulation")
        self._thread.start()

    def shutdown(self) -> None:
        """Stop time and close the viewer."""
        self._stop.set()
        with self._changed:
            self._changed.notify_all()
        self._thread.join()
        if self._viewer is not None:
            self._viewer.close()

    def _run(self) -> None:
        pacemaker = Pacemaker(PERIOD * 1e-9, self._settings.real_time_factor, self._stop)
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
                if self._viewer is not None:
                    self._viewer.update()
            if count % _GRIPPER_EVERY == 0:
                self._publish_grippers()
            if count % 100 == 0:
                self._report(pacemaker.seconds_lost)
            count += 1
            if self._settings.lockstep:
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
        self._states.publish(message)

    def _publish_grippers(self) -> None:
        """Send the grippers as a real Baxter does, each in a message of its own."""
        stamp = time_message(self._offset + self._simulation.nanoseconds)
        for name in GRIPPER_JOINTS:
            message = JointState(name=[name], position=[0.0], velocity=[0.0], effort=[0.0])
            message.header.stamp = stamp
            self._states.publish(message)

    def _on_command(self, message: JointState) -> None:
        self._take(lambda: self._simulation.command(message.name, message.velocity))

    def _on_guide(self, message: JointState) -> None:
        self._take(lambda: self._simulation.guide(message.name, message.position, message.velocity))

    def _take(self, order: Callable[[], None]) -> None:
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

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self._changed:
            self._offset += self._simulation.nanoseconds + PERIOD
            self._simulation.reset()
            self._answered = self._broken = False
            self._changed.notify_all()
            self._publish_state()
        response.success = True
        response.message = f"robot and debris are back where they began, pose {INITIAL_POSE}"
        return response

    def _report(self, seconds_lost: float) -> None:
        is_late = seconds_lost > 0.0
        self._health.report(
            WARN if is_late else OK,
            "too slow for the real_time_factor" if is_late else "running",
            simulated_seconds=f"{self._simulation.time:.2f}",
            seconds_behind=f"{seconds_lost:.2f}",
            rejected_commands=self._rejected,
            preset=self._settings.preset,
            lockstep=self._settings.lockstep,
        )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(BaxterSimulatorNode, argv)


if __name__ == "__main__":
    sys.exit(main())
