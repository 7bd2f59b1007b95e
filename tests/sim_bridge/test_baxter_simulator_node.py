"""The simulator on the wire: what a real Baxter sends and obeys, and how time passes."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from joint_commands import joint_command
from rclpy.executors import SingleThreadedExecutor
from ros_graph import RosGraph
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from irlpilco_ros.ros.messages import nanoseconds
from irlpilco_ros.ros.qos import CLOCK, JOINT_COMMAND, JOINT_STATES_SUB, OBJECT_POSE_PUB
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.baxter_simulator_node import BaxterSimulatorNode
from sim_bridge.joints import ARM_JOINTS, PUBLISHED_JOINTS
from sim_bridge.simulation_settings import SimulationSettings

pytestmark = pytest.mark.dds

NODE = "sim_bridge.baxter_simulator_node"


class States:
    """The joint states that come in, without the grippers' messages."""

    def __init__(self, ros: RosGraph, topic: str = "joint_states") -> None:
        self._listener = ros.listen(JointState, topic, JOINT_STATES_SUB, publishers=1)
        self._ros = ros

    @property
    def messages(self) -> list[JointState]:
        return [message for message in list(self._listener.messages) if len(message.name) > 1]

    @property
    def grippers(self) -> list[JointState]:
        return [message for message in list(self._listener.messages) if len(message.name) == 1]

    def position(self, joint: str) -> float:
        return self.messages[-1].position[PUBLISHED_JOINTS.index(joint)]

    def after(self, seconds: float) -> JointState:
        """Wait for the first state this much later in simulated time."""
        self._ros.wait_for(lambda: self.messages, "a joint state")
        goal = nanoseconds(self.messages[-1].header.stamp) + round(seconds * 1e9)
        self._ros.wait_for(
            lambda: nanoseconds(self.messages[-1].header.stamp) >= goal,
            f"{seconds} s of simulated time",
        )
        return self.messages[-1]


def test_speaks_and_obeys_as_a_baxter_does(ros: RosGraph) -> None:
    process = ros.start(
        NODE, namespace="/robot", parameters={"preset": "stiff", "position_noise": 0.0}
    )
    states = States(ros, "/robot/joint_states")
    commands = ros.publisher(JointState, "/robot/joint_command", JOINT_COMMAND, subscribers=1)
    states.after(0.5)
    received = states.messages
    assert all(tuple(message.name) == PUBLISHED_JOINTS for message in received)
    assert all(len(m.position) == len(m.velocity) == len(m.effort) == 17 for m in received)
    stamps = [nanoseconds(message.header.stamp) for message in received]
    # Best effort may lose a state on a busy machine; the others keep their distance.
    assert np.median(np.diff(stamps)) == 10_000_000
    assert not (np.diff(stamps) % 10_000_000).any()
    assert abs(stamps[-1] * 1e-9 - time.time()) < 10.0, "the stamps keep the wall clock's time"
    names = {tuple(message.name) for message in states.grippers}
    assert names == {("l_gripper_l_finger_joint",), ("r_gripper_l_finger_joint",)}
    assert ros.node.count_publishers("/clock") == 0

    start = states.position("right_w2")
    for message in nonsense():
        commands.publish(message)
        states.after(0.03)
    states.after(0.3)
    assert states.position("right_w2") == pytest.approx(start, abs=1e-4)

    def is_told() -> bool:
        commands.publish(nonsense()[0])  # again: of several that wait only the newest is taken
        return "unknown joints: left_s9" in process.output

    ros.wait_for(is_told, "a warning")
    assert process.output.count("unknown joints") == 1, "throttled"

    stop = threading.Event()
    sender = threading.Thread(target=repeat, args=(stop, commands, {"right_w2": 99.0}))
    sender.start()
    wrist = PUBLISHED_JOINTS.index("right_w2")

    def fastest() -> float:
        return max(message.velocity[wrist] for message in states.messages)

    ros.wait_for(lambda: fastest() > 3.6, "the limit's speed")
    states.after(0.2)
    stop.set()
    sender.join()
    assert fastest() == pytest.approx(4.0, rel=0.1), "clipped to the limit"
    states.after(0.8)
    held = states.position("right_w2")
    states.after(0.3)
    assert states.position("right_w2") == pytest.approx(held, abs=5e-3), "held after 0.2 s"
    assert process.stop(signal.SIGTERM) == 0


def nonsense() -> list[JointState]:
    nan = joint_command(1, ["right_w2"], [math.nan])
    short = JointState(name=["right_w2", "right_w1"], velocity=[1.0])
    unknown = joint_command(1, ["right_w2", "left_s9"], [1.0, 1.0])
    effort = joint_command(1, ["right_w2"], [5.0], interface="effort")
    return [unknown, nan, short, effort, JointState()]


def repeat(stop: threading.Event, publisher: Any, velocities: dict[str, float]) -> None:
    while not stop.wait(0.01):
        publisher.publish(joint_command(1, list(velocities), velocities.values()))


class Answerer:
    """Answers each new state once with a feedback on what was measured."""

    def __init__(self, ros: RosGraph, control: Callable[[np.ndarray], np.ndarray]) -> None:
        self.control = control
        self.states: list[np.ndarray] = []
        self.stamps: list[int] = []
        self.wanted = 0
        self._index = [PUBLISHED_JOINTS.index(name) for name in ARM_JOINTS]
        self._publisher = ros.publisher(JointState, "joint_command", JOINT_COMMAND, subscribers=1)
        ros.node.create_subscription(JointState, "joint_states", self.take, JOINT_STATES_SUB)

    def take(self, message: JointState) -> None:
        if len(message.name) != 17:
            return
        stamp = nanoseconds(message.header.stamp)
        is_new = not self.stamps or stamp != self.stamps[-1]
        if is_new and len(self.states) < self.wanted:
            self.stamps.append(stamp)
            state = np.concatenate([message.position, message.velocity])
            self.states.append(state)
            positions = state[:17][self._index]
            self._publisher.publish(joint_command(stamp, ARM_JOINTS, self.control(positions)))

    def collect(self, ros: RosGraph, count: int) -> np.ndarray:
        """Answer so many states and return them."""
        self.states, self.wanted = [], count
        ros.wait_for(lambda: len(self.states) >= count, f"{count} states")
        return np.array(self.states)


def feedback(positions: np.ndarray) -> np.ndarray:
    """A feedback on noisy readings, so that any difference grows."""
    return 0.3 * np.sin(40.0 * positions)


def test_lockstep_gives_the_same_bits_as_one_process(ros: RosGraph) -> None:
    ros.start(NODE, parameters={"lockstep": True, "seed": 7, "debris": 2})
    clock = ros.listen(Clock, "/clock", CLOCK, publishers=1)
    answerer = Answerer(ros, feedback)
    over_dds = answerer.collect(ros, 150)
    assert set(np.diff(answerer.stamps)) == {10_000_000}

    robot = BaxterSimulation(SimulationSettings(seed=7, debris=2))
    robot.step()
    in_process = []
    for _ in range(150):
        reading = robot.read()
        in_process.append(np.concatenate([reading.positions, reading.velocities]))
        robot.command(ARM_JOINTS, feedback(reading.state(ARM_JOINTS)[:14]))
        robot.step()
    np.testing.assert_array_equal(over_dds, in_process)

    ros.wait_for(lambda: len(clock.messages) > 150, "the unanswered state")
    clock.clear()
    ros.wait_for(lambda: len(clock.messages) >= 4, "repetitions of the unanswered state")
    assert len({nanoseconds(message.clock) for message in clock.messages}) == 1, "time stands still"

    before = nanoseconds(clock.messages[-1].clock)
    assert ros.trigger("baxter_simulator/reset").success
    robot.reset()
    answerer.collect(ros, 1)
    np.testing.assert_array_equal(answerer.states[0][:17], robot.read().positions)
    assert answerer.stamps[-1] > before, "time goes on over a reset"


def test_nonsense_does_not_advance_lockstep(ros: RosGraph) -> None:
    ros.start(NODE, parameters={"lockstep": True})
    states = States(ros)
    commands = ros.publisher(JointState, "joint_command", JOINT_COMMAND, subscribers=1)
    ros.wait_for(lambda: states.messages, "a joint state")
    for message in nonsense():
        commands.publish(message)
        time.sleep(0.03)
    count = len(states.messages)
    ros.wait_for(lambda: len(states.messages) > count + 2, "repetitions")
    assert len({nanoseconds(message.header.stamp) for message in states.messages}) == 1
    commands.publish(joint_command(1, ["left_s0"], [0.1]))
    states.after(0.01)


@pytest.mark.parametrize(("factor", "slowest", "fastest"), [(4.0, 2.0, 4.6), (0.0, 1.5, 1e9)])
def test_real_time_factor(ros: RosGraph, factor: float, slowest: float, fastest: float) -> None:
    ros.start(NODE, parameters={"real_time_factor": factor})
    clock = ros.listen(Clock, "/clock", CLOCK, publishers=1)
    ros.wait_for(lambda: len(clock.messages) > 20, "the clock")
    begin, started = nanoseconds(clock.messages[-1].clock), clock.arrivals[-1]
    ros.wait_for(lambda: clock.arrivals[-1] > started + 1.0, "a second")
    elapsed = (nanoseconds(clock.messages[-1].clock) - begin) * 1e-9
    assert slowest <= elapsed / (clock.arrivals[-1] - started) <= fastest


def test_broken_physics_stop_the_states_until_reset(
    ros: RosGraph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo leaves its log
    rclpy.init(domain_id=ros.domain)
    node = BaxterSimulatorNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    try:
        states = States(ros)
        health = ros.listen(DiagnosticArray, "/diagnostics", 10, publishers=1)
        states.after(0.1)
        simulation: Any = node._simulation
        simulation.data.qvel[0] = math.nan
        ros.wait_for(lambda: is_bad(health.messages), "an error in /diagnostics")
        count = len(states.messages)
        time.sleep(0.1)
        assert len(states.messages) <= count + 1
        assert ros.trigger("baxter_simulator/reset").success
        states.after(0.1)
        assert np.isfinite(states.messages[-1].position).all()
    finally:
        node.shutdown()
        executor.shutdown()
        spinner.join()
        node.destroy_node()
        rclpy.shutdown()


def is_bad(messages: list[DiagnosticArray]) -> bool:
    return any(
        status.level == DiagnosticStatus.ERROR and "broke down" in status.message
        for message in messages
        for status in message.status
    )


def test_viewer_without_a_display_is_refused(ros: RosGraph) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        ros.environment.pop(name, None)
    process = ros.start(NODE, parameters={"viewer": True}, wait=False)
    process.expected_code = 1
    assert process.wait() == 1
    assert "error: the viewer needs a display" in process.output
    assert "Traceback" not in process.output


def test_a_wrong_parameter_is_refused(ros: RosGraph) -> None:
    process = ros.start(NODE, parameters={"speed_factor": [1.0, 1.0]}, wait=False)
    process.expected_code = 1
    assert process.wait() == 1
    assert "speed_factor has 2 values; expected 1" in process.output


def test_shipped_parameter_file_is_complete(ros: RosGraph) -> None:
    ros.start(NODE, files=["config/baxter_simulator.yaml"])
    assert ros.get_parameter("baxter_simulator", "debris") == 12
    assert ros.get_parameter("baxter_simulator", "preset") == "compliant"


def test_a_camera_sees_where_the_pile_lies(ros: RosGraph) -> None:
    ros.start(NODE, parameters={"debris": 3})
    seen = ros.listen(PoseStamped, "object_pose", OBJECT_POSE_PUB, publishers=1)

    def places() -> np.ndarray:
        return np.array([[m.pose.position.x, m.pose.position.y] for m in list(seen.messages)])

    ros.wait_for(lambda: len(seen.messages) >= 10, "some poses")
    off = places() - [0.645, -0.15]
    assert 1e-4 < np.abs(off).max() < 0.02
    answer = ros.set_parameters("baxter_simulator", {"object_place": [0.05, -0.03, 0.2]})
    assert answer.successful, answer.reason
    ros.wait_for(
        lambda: np.abs(places()[-5:] - [0.695, -0.18]).max() < 0.02, "poses of the new place"
    )
    turned = [m.pose.orientation for m in list(seen.messages)[-5:]]
    assert np.mean([2.0 * math.atan2(each.z, each.w) for each in turned]) == pytest.approx(
        0.2, abs=0.03
    )
