"""Somebody else on the wire: a motion ends, is told, and does not count."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest
from controlled_robot import (
    CONTROLLER,
    JOINTS,
    LONG,
    MOVING,
    ROBOT,
    assert_stopped,
    begin_trial,
    is_told,
)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fake_robot import FakeRobot
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode
from irlpilco_ros.ros.messages import nanoseconds
from irlpilco_ros.ros.qos import JOINT_COMMAND

pytestmark = pytest.mark.dds

TOLD = (DiagnosticStatus.WARN, DiagnosticStatus.ERROR)


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


@pytest.fixture
def stranger(graph):
    """Another publisher of joint_command, which appears only when it is called."""
    made = []

    def appear():
        made.append(graph.publisher(JointState, "joint_command", JOINT_COMMAND, subscribers=2))
        return made[0]

    yield appear
    for publisher in made:
        graph.node.destroy_publisher(publisher)
    graph.wait_for(lambda: graph.node.count_publishers("joint_command") == 1, "its end")


def command(stamp, *values):
    return JointStateMessage(stamp, tuple(JOINTS), (), tuple(values))


def test_own_commands_are_nobody_elses(graph, robot):
    answer = begin_trial(graph, robot, MOVING)
    time.sleep(0.5)
    assert not answer.done()
    graph.trigger("controller/stop")


def test_a_foreign_command_with_our_own_stamp_ends_the_trial(graph, robot, stranger, diagnostics):
    answer = begin_trial(graph, robot, MOVING)
    publisher = stranger()
    stamp = nanoseconds(robot.commands[-1].header.stamp)
    publisher.publish(encode(command(stamp, -0.1, 0.2)))
    reason = "somebody else commanded the robot: elbow -0.1, wrist 0.2 on joint_command"
    graph.wait_for(answer.done, "the answer")
    assert not answer.result().success
    assert reason in answer.result().message
    assert "/joint_command is published by " in answer.result().message  # its name may come later
    graph.wait_for(lambda: is_told(diagnostics, reason), "diagnostics")


def test_bytes_that_are_no_command_are_foreign_too(graph, robot, stranger):
    answer = begin_trial(graph, robot, MOVING)
    stranger().publish(b"\0\1\0\0garbage...")
    graph.wait_for(answer.done, "the answer")
    assert "somebody else commanded the robot" in answer.result().message
    assert "bytes are no sensor_msgs/msg/JointState" in answer.result().message


def test_another_publisher_is_told_and_motions_are_refused(graph, robot, stranger, diagnostics):
    graph.wait_for(lambda: len(robot.states) > 5, "states")
    stranger()
    who = f"/joint_command is published by /{graph.node.get_name()}, too"
    graph.wait_for(lambda: is_told(diagnostics, who, TOLD), "a warning")
    assert graph.set_parameters("controller", MOVING).successful
    for service in ("controller/run_trial", "controller/move_to_start"):
        assert graph.set_parameters("controller", {"start_position": [0.0, 0.0]}).successful
        answer = graph.trigger(service)
        assert not answer.success
        assert who in answer.message
    assert robot.commands == []


def test_a_hand_that_guides_the_robot_ends_the_trial(graph, robot, diagnostics):
    hand = graph.publisher(JointState, "baxter_simulator/guide", JOINT_COMMAND, subscribers=1)
    answer = begin_trial(graph, robot, MOVING)
    hand.publish(encode(JointStateMessage(1, ("elbow",), (0.1,), (0.0,))))
    reason = "somebody guides the robot by hand, on baxter_simulator/guide"
    assert_stopped(graph, robot, answer, reason, diagnostics)


def test_a_foreign_command_right_at_the_end_costs_the_trial(ros):
    ros.start(CONTROLLER, parameters={**ROBOT, **MOVING})
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        publishers = []

        def disturb(message):
            """Command along with the last state but one: the next answer would be the last."""
            if len(robot.commands) == 40 and publishers:
                publishers.pop().publish(encode(command(robot.stamp, 0.5, 0.5)))

        ros.wait_for(lambda: len(robot.states) > 5, "states")
        answer = ros.trigger_async("controller/run_trial")
        ros.wait_for(lambda: answer.done() or len(robot.commands) > 2, "commands")
        publishers.append(ros.publisher(JointState, "joint_command", JOINT_COMMAND))
        robot.distort = disturb
        ros.wait_for(answer.done, "the answer")
        if not publishers:  # it did come in the trial
            assert not answer.result().success


def test_a_second_controller_is_told_by_both_and_neither_moves(ros):
    first = ros.start(CONTROLLER, parameters={**ROBOT, **MOVING})
    heard = ros.listen(DiagnosticArray, "/diagnostics", publishers=1)
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        ros.wait_for(lambda: len(robot.states) > 5, "states")
        second = ros.start(CONTROLLER, parameters={**ROBOT, **MOVING}, wait=False)
        sentence = "there is a second node /controller"
        ros.wait_for(lambda: is_told(heard, sentence, TOLD), "a warning")
        for process in (first, second):
            ros.wait_for(lambda process=process: sentence in process.output, "a log")
        answer = ros.trigger("controller/run_trial")
        assert not answer.success
        assert sentence in answer.message
        assert robot.commands == []
        second.stop(signal.SIGINT)
        ros.wait_for(lambda: ros.trigger("controller/run_trial").success, "the one that is left")


def test_a_controller_started_again_after_a_kill_is_not_held_up_by_its_ghost(ros):
    ros.start(CONTROLLER, parameters={**ROBOT, **MOVING}).kill()
    ros.start(CONTROLLER, parameters={**ROBOT, **MOVING})
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        began = time.monotonic()
        ros.wait_for(lambda: robot.states, "states")

        def ran() -> bool:
            answer = ros.trigger_async("controller/run_trial")  # the ghost's client may be found
            end = time.monotonic() + 3.0
            while not answer.done() and time.monotonic() < end:
                time.sleep(0.01)
            return answer.done() and answer.result().success

        ros.wait_for(ran, "a trial", 15.0)
        assert time.monotonic() - began < 20.0
    assert np.abs(robot.vector("positions")).max() > 0.0
