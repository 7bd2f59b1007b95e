"""What guards the robot cannot be taken down under way, and what is off is off after a restart."""

from __future__ import annotations

import time

import pytest
from controlled_robot import (
    CONTROLLER,
    JOINTS,
    LONG,
    MOVING,
    ROBOT,
    assert_stopped,
    begin_trial,
    table,
)
from diagnostic_msgs.msg import DiagnosticArray
from fake_robot import FakeRobot
from std_srvs.srv import SetBool

pytestmark = pytest.mark.dds


@pytest.fixture(scope="module")
def graph(shared_ros):
    shared_ros.start(CONTROLLER, parameters=LONG)
    return shared_ros


@pytest.fixture(scope="module")
def diagnostics(graph):
    return graph.listen(DiagnosticArray, "/diagnostics", publishers=1)


@pytest.fixture
def robot(graph):
    with FakeRobot(graph, JOINTS, lockstep=True) as fake:
        yield fake


@pytest.mark.parametrize(
    ("guard", "value", "back"),
    [
        ("position_margin", -1.0, 0.05),
        ("state_timeout", 0.5, 1.0),
        ("command_timeout", 0.5, 1.0),
        ("stall_timeout", 10.0, 1.0),
        ("guard_sigma", 6.0, 0.0),
    ],
)
def test_a_change_of_a_guard_ends_the_trial(graph, robot, diagnostics, guard, value, back):
    answer = begin_trial(graph, robot, MOVING)
    assert graph.set_parameters("controller", {guard: value}).successful
    reason = f"what guards it was changed under way: {guard} from {back:g} to {value:g}"
    assert_stopped(graph, robot, answer, reason, diagnostics)
    assert graph.set_parameters("controller", {guard: back}).successful


def test_guards_have_bounds(graph):
    for guard in ("state_timeout", "command_timeout"):
        assert not graph.set_parameters("controller", {guard: 10.0}).successful


def test_a_trial_does_not_begin_far_from_its_start(graph, robot):
    there = {"start_position": [0.0, 0.3]}
    assert graph.set_parameters("controller", {**MOVING, **there}).successful
    graph.wait_for(lambda: len(robot.states) > 5, "states")
    answer = graph.trigger("controller/run_trial")
    assert not answer.success
    assert "joint wrist is 0.3000 rad from the policy's start" in answer.message
    assert robot.commands == []
    assert graph.set_parameters("controller", {"trial_start_tolerance": 0.4}).successful
    begin_trial(graph, robot, MOVING)
    graph.trigger("controller/stop")
    back = {"trial_start_tolerance": 0.05, "start_position": [0.0, 0.0]}
    assert graph.set_parameters("controller", back).successful


def test_a_joint_that_is_blocked_stops_the_robot(graph, robot, diagnostics):
    def block(message):
        message.position = [0.0] * len(message.name)

    robot.distort = block
    answer = begin_trial(graph, robot, table(*[[0.5, 0.0]] * 50))
    reason = "joint elbow is commanded but does not move: in 1 s it was to go 0.5"
    assert_stopped(graph, robot, answer, reason, diagnostics)


def test_what_is_disabled_stays_disabled(ros):
    off = SetBool.Request(data=False)
    controller = ros.start(CONTROLLER, parameters=ROBOT)
    assert ros.call(SetBool, "controller/enable", off).message == "disabled"
    assert ros.get_parameter("controller", "enabled") is False
    controller.stop()
    ros.start(CONTROLLER, parameters={**ROBOT, **MOVING, "enabled": False})
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        ros.wait_for(lambda: len(robot.states) > 5, "states")
        assert "the controller is disabled" in ros.trigger("controller/run_trial").message
        assert ros.set_parameters("controller", {"enabled": True}).successful
        ros.wait_for(lambda: ros.trigger("controller/run_trial").success, "a trial")


def test_commands_are_repeated_for_a_watchdog_while_states_advance(ros):
    ros.start(CONTROLLER, parameters={**LONG, **MOVING, "command_rate": 200.0})
    with FakeRobot(ros, JOINTS, wall_step=0.05) as robot:
        ros.wait_for(lambda: len(robot.states) > 5, "states")
        answer = ros.trigger_async("controller/run_trial")
        ros.wait_for(lambda: len(robot.commands) > 100 or answer.done(), "commands")
        assert not answer.done(), answer.result().message
        count, states = len(robot.commands), len(robot.states)
        time.sleep(0.5)
        assert len(robot.commands) - count > 3 * (len(robot.states) - states)
        ros.trigger("controller/stop")
        ros.wait_for(answer.done, "the answer")
        count = len(robot.commands)
        time.sleep(0.1)
        assert len(robot.commands) == count, "nothing while idle"
