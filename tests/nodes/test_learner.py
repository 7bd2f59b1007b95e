"""The learner over DDS, with a robot that exists in the test only: answers, failures, refusals."""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import toy_robot
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.parameter import parameter_value_to_python
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.policy_file import policy_from_parameters, read_policy_file
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import from_values
from irlpilco_ros.ros.qos import DIAGNOSTICS, LATCHED

pytestmark = pytest.mark.dds

SETTINGS = {"evaluations": 6, "linear_phase.count": 3}


class FakeRobot:
    """Controller and recorder in one: runs trials on the toy robot and writes their bags."""

    def __init__(self, graph, namespace):
        self.calls: list[str] = []
        self.parameters: dict[str, dict] = {
            "controller": {},
            "demonstration_recorder": {},
        }
        self.refuse: dict[str, str] = {}
        self.steps = toy_robot.HORIZON
        self.go = threading.Event()
        self.go.set()
        self.seed = 0
        for name in ("controller", "demonstration_recorder"):
            graph.node.create_service(
                SetParametersAtomically,
                f"{namespace}/{name}/set_parameters_atomically",
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
                f"{namespace}/{name}",
                lambda _, response, name=name: self._answer(name, response),
                callback_group=MutuallyExclusiveCallbackGroup(),
            )
        self._recording = False
        self._directory = ""
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
            self._directory = self.parameters["demonstration_recorder"].pop("next_directory")
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
        return write_trajectory(Path(self._directory), trial)


class Workplace:
    """A learner with a robot of the test's own, in a namespace of their own."""

    def __init__(self, graph, folder, namespace, robot=True, **parameters):
        self.graph = graph
        self.namespace = namespace
        self.run = RunDirectory(folder / "run")
        self.robot = FakeRobot(graph, namespace) if robot else None
        self.learner = start_learner(graph, folder, namespace, **parameters)
        graph.wait_for(self.learner_is_there, "the learner")

    def learner_is_there(self):
        return ("learner", self.namespace) in self.graph.node.get_node_names_and_namespaces()

    def learn(self):
        return self.graph.trigger(f"{self.namespace}/learn_iteration")


def start_learner(graph, folder, namespace="", **parameters):
    robot_file = folder / "robot.yaml"
    robot_file.write_text(toy_robot.ROBOT_FILE)
    values = {**SETTINGS, "run_directory": str(folder / "run"), **parameters}
    module = "irlpilco_ros.nodes.learner"
    return graph.start(
        module, parameters=values, files=[robot_file], namespace=namespace, wait=False
    )


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return toy_robot.record_demonstration(tmp_path_factory.mktemp("demonstration"))


@pytest.fixture(scope="module")
def place(shared_ros, bag, tmp_path_factory):
    """One run, which the tests take further and further."""
    folder = tmp_path_factory.mktemp("place")
    return Workplace(shared_ros, folder, "/first", demonstration=str(bag))


def test_two_iterations(place):
    graph, robot = place.graph, place.robot
    health = graph.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
    numbers = {
        name: graph.listen(Float64, f"/first/learner/progress/{name}", DIAGNOSTICS, publishers=1)
        for name in ("iteration", "fraction", "cost", "error")
    }
    first = place.learn()
    assert first.success, first.message
    assert first.message.startswith("iteration 1: trial 001 is 0.0")
    assert "\n" not in first.message
    trial = ["demonstration_recorder/start", "controller/run_trial", "demonstration_recorder/stop"]
    assert robot.calls == [
        "controller/stop",
        "demonstration_recorder/stop",
        *["controller/move_to_start", *trial] * 2,
    ]
    assert not robot.parameters["demonstration_recorder"], "the recorder is as it was"
    second = place.learn()
    assert second.success, second.message
    found = place.run.metrics()
    assert [row.iteration for row in found] == [0, 1, 2]
    assert found[2].rmse_rad < found[0].rmse_rad / 3

    in_force, _ = policy_from_parameters(robot.parameters["controller"])
    on_file, _ = read_policy_file(place.run.policy_file(2))
    np.testing.assert_array_equal(in_force.parameters, on_file.parameters)

    def told():
        states = [s for m in health.messages for s in m.status if s.name == "first/learner"]
        return {state.message for state in states} >= {"learning", "idle"}

    graph.wait_for(told, "diagnostics of the learner")

    def last(name):
        return numbers[name].messages[-1].data if numbers[name].messages else None

    graph.wait_for(lambda: last("error") == found[2].error_rad, "the error of the last trial")
    graph.wait_for(lambda: last("fraction") == 0.0, "an idle learner")
    values = {name: {each.data for each in heard.messages} for name, heard in numbers.items()}
    assert values["iteration"] <= {0.0, 1.0, 2.0}, "nothing while idle"
    assert 2.0 in values["iteration"]
    assert all(np.isfinite(list(each)).all() for each in values.values())
    for line in (
        "ready for iteration 0; run directory ",
        "iteration 0: trial 000 is ",
        "iteration 1: training the model",
        "iteration 2: searching the policy",
        "iteration 2: the robot goes to the start",
        "iteration 2: the robot tries the policy",
        "iteration 2: trial 002 is ",
    ):
        assert place.learner.output.count(line) == 1, line


def test_the_prediction_waits_for_whoever_comes_late(place):
    if not place.run.iterations():
        place.learn()
    topic = "/first/learner/predicted_trajectory"
    latecomer = place.graph.listen(JointTrajectory, topic, LATCHED)
    place.graph.wait_for(lambda: latecomer.messages, "the latched prediction")
    prediction = latecomer.messages[-1]
    assert tuple(prediction.joint_names) == toy_robot.JOINTS
    assert len(prediction.points) == toy_robot.HORIZON + 1
    assert prediction.points[3].time_from_start.sec == 1
    assert prediction.points[3].time_from_start.nanosec == 500_000_000
    demonstrated = toy_robot.demonstrated().positions
    predicted = np.array([point.positions for point in prediction.points])
    assert np.abs(predicted - demonstrated).max() < 0.05


def test_a_second_call_hears_busy_at_once_and_disturbs_nothing(place):
    graph, robot = place.graph, place.robot
    before = len(place.run.metrics())
    robot.go.clear()
    robot.calls.clear()
    first = graph.trigger_async("/first/learn_iteration")
    graph.wait_for(lambda: "controller/run_trial" in robot.calls, "the trial")
    # The test's node is held up in run_trial, and so another process has to ask.
    script = (
        "from irlpilco_ros.ros.session import Session\n"
        "with Session('other', '/first') as session: session.trigger('learn_iteration', 5.0)"
    )
    other = graph.run([sys.executable, "-c", script])
    other.expected_code = 1
    assert other.wait() == 1
    assert "is under way (trial)" in other.output
    assert "refused: busy: iteration " in other.output
    robot.go.set()
    graph.wait_for(first.done, "the first call")
    assert first.result().success
    assert len(place.run.metrics()) > before


@pytest.mark.parametrize(
    ("service", "reason"),
    [
        ("controller/run_trial", "joint left_w2 is close to its limit"),
        ("controller/move_to_start", "an arm is blocked"),
        ("demonstration_recorder/start", "the disk is full"),
    ],
)
def test_a_failure_is_told_and_the_next_call_goes_on(place, service, reason):
    before = place.run.metrics_file.read_text()
    following = len(place.run.metrics())
    place.robot.refuse[service] = reason
    failed = place.learn()
    assert not failed.success
    assert reason in failed.message
    assert place.run.metrics_file.read_text() == before
    place.robot.parameters["demonstration_recorder"].clear()  # as the recorder does at `start`
    again = place.learn()
    assert again.message.startswith(f"iteration {following}: ")


def test_a_trial_that_breaks_off_does_not_count(place):
    before = place.run.metrics_file.read_text()
    place.robot.steps = 3
    failed = place.learn()
    place.robot.steps = toy_robot.HORIZON
    assert not failed.success
    assert "the trial broke off after 4 of 6 commands" in failed.message
    assert place.run.metrics_file.read_text() == before
    torn = place.run.trial_bags()[-1]
    assert place.learn().success
    assert place.run.metrics()[-1].trial == torn[0] + 1
    assert torn[1].exists()


def test_two_learners_do_not_share_a_run(place):
    twin = start_learner(place.graph, place.run.path.parent, "/twin")
    twin.expected_code = 1
    assert twin.wait() == 1
    assert "is in use by another learner" in twin.output


def test_without_a_demonstration_it_says_what_to_do(shared_ros, bag, tmp_path):
    place = Workplace(shared_ros, tmp_path, "/second")
    refused = place.learn()
    assert not refused.success
    assert "set the learner's parameter `demonstration`" in refused.message
    assert shared_ros.set_parameters("/second/learner", {"demonstration": str(bag)}).successful
    assert place.learn().success


def test_a_policy_slower_than_its_demonstration_is_told_of_at_hand_over(shared_ros, bag, tmp_path):
    slow = {"velocity_limit": [0.33, 1.0], "demonstration": str(bag)}
    place = Workplace(shared_ros, tmp_path, "/slow", **slow)
    place.robot.refuse["controller/run_trial"] = "not today"
    assert not place.learn().success
    assert (
        "iteration 0: the policy is slower than its demonstration needs: shoulder at 0.35 rad/s"
        in (place.learner.output)
    )
    assert "the policy is slower" in place.learn().message


def test_without_a_robot_it_says_which_node_is_missing(shared_ros, bag, tmp_path):
    place = Workplace(shared_ros, tmp_path, "/third", robot=False, demonstration=str(bag))
    refused = place.learn()
    assert not refused.success
    assert "controller/stop is not there" in refused.message
    assert place.learner.stop(signal.SIGTERM) == 0


def test_names_of_before_are_understood_at_the_start(shared_ros, bag, tmp_path):
    settings = LearningSettings(evaluations=6, options={"linear_phase.count": 4})
    Apprenticeship.open(tmp_path / "run", bag, toy_robot.ROBOT, settings).close()
    robot_file = tmp_path / "robot.yaml"
    robot_file.write_text(toy_robot.ROBOT_FILE)
    health = shared_ros.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
    before = {"phase_count": 4, "evaluations": 6, "run_directory": str(tmp_path / "run")}
    learner = shared_ros.start(
        "irlpilco_ros.nodes.learner", parameters=before, files=[robot_file], namespace="/before"
    )
    shared_ros.wait_for(
        lambda: any(
            status.name.endswith("before/learner") and status.message == "ready for iteration 0"
            for message in health.messages
            for status in message.status
        ),
        "the run of before to be taken up",
    )
    assert learner.output.count("phase_count is called linear_phase.count now") == 1


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"seed": 5}, "another configuration: seed was 0, now 5"),
        ({"demonstration": "other"}, "begun with another demonstration"),
        ({"optimiser": "magic"}, "LearningSettings.optimiser is 'magic'; valid values:"),
    ],
)
def test_a_wrong_run_is_refused_at_the_start(shared_ros, bag, tmp_path, change, reason):
    settings = from_values(LearningSettings, SETTINGS)
    Apprenticeship.open(tmp_path / "run", bag, toy_robot.ROBOT, settings).close()
    if "demonstration" in change:
        plan = Apprenticeship.open(tmp_path / "other", bag, toy_robot.ROBOT, settings).prepare()
        change = {"demonstration": str(toy_robot.record_trial(plan, tmp_path / "bags"))}
    learner = start_learner(shared_ros, tmp_path, "/wrong", **change)
    learner.expected_code = 1
    assert learner.wait() == 1
    assert reason in learner.output
    assert "Traceback" not in learner.output
