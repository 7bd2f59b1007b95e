"""The learner over DDS, with a robot that exists in the test only: answers, failures, refusals."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
import toy_robot
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.parameter import parameter_value_to_python
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from irlpilco_ros.experience.policy_file import policy_from_parameters, read_policy_file
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.nodes.qos import DIAGNOSTICS, LATCHED

pytestmark = pytest.mark.dds

SETTINGS = {"evaluations": 6, "phase_count": 3}


class FakeRobot:
    """Controller and recorder in one: runs trials on the toy robot and writes their bags."""

    def __init__(self, graph):
        self.calls: list[str] = []
        self.parameters: dict[str, dict] = {"controller": {}, "demonstration_recorder": {}}
        self.refuse: dict[str, str] = {}
        self.steps = toy_robot.HORIZON
        self.go = threading.Event()
        self.go.set()
        self.seed = 0
        for name in ("controller", "demonstration_recorder"):
            graph.node.create_service(
                SetParametersAtomically,
                f"{name}/set_parameters_atomically",
                lambda request, response, name=name: self._set(name, request, response),
            )
        for name in (
            "controller/stop",
            "controller/move_to_start",
            "controller/run_trial",
            "demonstration_recorder/start",
            "demonstration_recorder/stop",
        ):
            graph.node.create_service(
                Trigger,
                name,
                lambda _, response, name=name: self._answer(name, response),
                callback_group=MutuallyExclusiveCallbackGroup(),
            )
        self._recording = False
        self._bag: Path | None = None

    def _set(self, name, request, response):
        values = {p.name: parameter_value_to_python(p.value) for p in request.parameters}
        self.parameters[name].update(values)
        response.result.successful = True
        return response

    def _answer(self, name, response):
        self.calls.append(name)
        if name == "demonstration_recorder/stop":
            response.success, self._recording = self._recording, False
            response.message = f"7 samples; bag: {self._bag}" if response.success else "idle"
            return response
        if name in self.refuse:
            response.message = self.refuse.pop(name)
            return response
        if name == "demonstration_recorder/start":
            self._recording = True
        if name == "controller/run_trial":
            self.go.wait(20.0)
            self._bag = self._try_policy()
        response.success = True
        return response

    def _try_policy(self):
        policy, _ = policy_from_parameters(self.parameters["controller"])
        start = self.parameters["controller"]["start_position"]
        self.seed += 1
        trial = toy_robot.trial_of(policy, start, self.seed, self.steps)
        directory = self.parameters["demonstration_recorder"]["output_directory"]
        return toy_robot.write_trajectory(Path(directory), trial)


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return toy_robot.record_demonstration(tmp_path_factory.mktemp("demonstration"))


@pytest.fixture
def robot_file(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(toy_robot.ROBOT_FILE)
    return file


@pytest.fixture
def start(ros, tmp_path, robot_file):
    """Start a learner on the run directory tmp_path/run."""

    def begin(wait=True, **parameters):
        values = {**SETTINGS, "run_directory": str(tmp_path / "run"), **parameters}
        return ros.start(
            "irlpilco_ros.nodes.learner", parameters=values, files=[robot_file], wait=wait
        )

    return begin


@pytest.fixture
def robot(ros):
    return FakeRobot(ros)


def rows(tmp_path):
    return RunDirectory(tmp_path / "run").metrics()


def test_two_iterations(ros, start, robot, bag, tmp_path):
    start(demonstration=str(bag))
    health = ros.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
    first = ros.trigger("learn_iteration")
    assert first.success, first.message
    assert first.message.startswith("iteration 1: trial 001 is 0.0")
    assert "\n" not in first.message
    trial = ["demonstration_recorder/start", "controller/run_trial", "demonstration_recorder/stop"]
    assert robot.calls == [
        "controller/stop",
        "demonstration_recorder/stop",
        *["controller/move_to_start", *trial] * 2,
    ]
    second = ros.trigger("learn_iteration")
    assert second.success, second.message
    found = rows(tmp_path)
    assert [row.iteration for row in found] == [0, 1, 2]
    assert found[2].rmse_rad < found[0].rmse_rad / 3

    in_force, _ = policy_from_parameters(robot.parameters["controller"])
    on_file, _ = read_policy_file(tmp_path / "run" / "policy_002.yaml")
    np.testing.assert_array_equal(in_force.parameters, on_file.parameters)

    latecomer = ros.listen(JointTrajectory, "learner/predicted_trajectory", LATCHED)
    ros.wait_for(lambda: latecomer.messages, "the latched prediction")
    prediction = latecomer.messages[-1]
    assert tuple(prediction.joint_names) == toy_robot.JOINTS
    assert len(prediction.points) == toy_robot.HORIZON + 1
    assert prediction.points[3].time_from_start.sec == 1
    assert prediction.points[3].time_from_start.nanosec == 500_000_000
    demonstrated = toy_robot.demonstrated().positions
    predicted = np.array([point.positions for point in prediction.points])
    assert np.abs(predicted - demonstrated).max() < 0.05

    def told():
        states = [s for m in health.messages for s in m.status if s.name == "learner"]
        return {state.message for state in states} >= {"learning", "idle"}

    ros.wait_for(told, "diagnostics of the learner")


def test_a_second_call_hears_busy_at_once_and_disturbs_nothing(ros, start, robot, bag, tmp_path):
    start(demonstration=str(bag))
    robot.go.clear()
    first = ros.trigger_async("learn_iteration")
    ros.wait_for(lambda: "demonstration_recorder/start" in robot.calls, "the first trial")
    # The test's node is held up in run_trial, and so another process has to ask.
    script = (
        "from irlpilco_ros.nodes.session import Session\n"
        "with Session('other') as session: session.trigger('learn_iteration', 5.0)"
    )
    import sys

    other = ros.run([sys.executable, "-c", script])
    other.expected_code = 1
    assert other.wait() == 1
    assert "busy: iteration 0 is under way (trial)" in other.output
    robot.go.set()
    ros.wait_for(first.done, "the first call")
    assert first.result().success
    assert len(rows(tmp_path)) == 2


@pytest.mark.parametrize(
    ("service", "reason"),
    [
        ("controller/run_trial", "joint left_w2 is close to its limit"),
        ("controller/move_to_start", "an arm is blocked"),
        ("demonstration_recorder/start", "the disk is full"),
    ],
)
def test_a_failure_is_told_and_the_next_call_goes_on(
    ros, start, robot, bag, tmp_path, service, reason
):
    start(demonstration=str(bag))
    assert ros.trigger("learn_iteration").success
    before = rows(tmp_path)
    robot.refuse[service] = reason
    failed = ros.trigger("learn_iteration")
    assert not failed.success
    assert reason in failed.message
    assert rows(tmp_path) == before or repr(rows(tmp_path)) == repr(before)
    again = ros.trigger("learn_iteration")
    assert again.message.startswith("iteration 2: ")


def test_a_trial_that_breaks_off_does_not_count(ros, start, robot, bag, tmp_path):
    start(demonstration=str(bag))
    robot.steps = 3
    failed = ros.trigger("learn_iteration")
    assert not failed.success
    assert "broke off" in failed.message or "control periods" in failed.message
    assert rows(tmp_path) == ()
    robot.steps = toy_robot.HORIZON
    assert ros.trigger("learn_iteration").success
    assert [row.trial for row in rows(tmp_path)] == [1, 2]
    assert (tmp_path / "run" / "trials" / "000").exists()


def test_without_a_demonstration_it_says_what_to_do(ros, start, robot, bag):
    start()
    refused = ros.trigger("learn_iteration")
    assert not refused.success
    assert "set the learner's parameter `demonstration`" in refused.message
    assert ros.set_parameters("learner", {"demonstration": str(bag)}).successful
    assert ros.trigger("learn_iteration").success


def test_a_restarted_learner_goes_on(ros, start, robot, bag):
    learner = start(demonstration=str(bag))
    assert ros.trigger("learn_iteration").success
    learner.kill()
    ros.wait_for(lambda: "learner" not in ros.node.get_node_names(), "its end", timeout=30.0)
    start()  # the run directory has the demonstration
    assert ros.trigger("learn_iteration").message.startswith("iteration 2: ")


def test_another_run_is_refused_at_the_start(ros, start, robot, bag, tmp_path):
    learner = start(demonstration=str(bag))
    assert ros.trigger("learn_iteration").success
    twin = start(wait=False)
    twin.expected_code = 1
    assert twin.wait() == 1
    assert "is in use by another learner" in twin.output
    assert learner.stop() == 0
    other = start(wait=False, seed=5)
    other.expected_code = 1
    assert other.wait() == 1
    assert "another configuration: seed was 0, now 5" in other.output
    other = start(wait=False, demonstration=str(tmp_path / "run" / "trials" / "000"))
    other.expected_code = 1
    assert other.wait() == 1
    assert "another demonstration" in other.output


def test_without_a_robot_it_says_which_node_is_missing(ros, start, bag):
    start(demonstration=str(bag))
    refused = ros.trigger("learn_iteration")
    assert not refused.success
    assert "controller/stop is not there" in refused.message
