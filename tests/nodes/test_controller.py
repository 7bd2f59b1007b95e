"""The controller as a process: motions, and every reason to stop, caused over DDS."""

from __future__ import annotations

import math
import signal
import time

import numpy as np
import pytest
from controlled_robot import (
    CONTROLLER,
    HORIZON,
    JOINTS,
    LONG,
    MOVING,
    PERIOD,
    ROBOT,
    assert_stopped,
    begin_trial,
    table,
    trigger_when_heard,
)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fake_robot import FakeRobot
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool

from irlpilco_ros.experience.demonstrated import Demonstrated
from irlpilco_ros.experience.policy_file import policy_to_parameters, write_policy_file
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import LinearPolicy, OpenLoopPolicy
from irlpilco_ros.ros.messages import nanoseconds
from irlpilco_ros.ros.qos import COMMAND_RECORDING, JOINT_STATES_PUB

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
    # In lockstep, lest a busy computer loses states: that would be another reason to stop.
    with FakeRobot(graph, JOINTS, lockstep=True) as fake:
        yield fake
    assert graph.set_parameters("controller", table([0.0, 0.0])).successful


GAINS = np.array([[0.5, 0.0, 0.1, 0.0], [0.0, -0.5, 0.0, 0.1]])
LINEAR = LinearPolicy(GAINS, np.array([0.3, -0.4]), np.array([1.0, 2.0]))


def run_trial(ros, lockstep):
    """Run one trial of LINEAR; return the robot, and its commands by their stamps."""
    ros.start(
        CONTROLLER, parameters={**ROBOT, **policy_to_parameters(LINEAR, Joints(tuple(JOINTS)))}
    )
    with FakeRobot(ros, JOINTS, [0.1, -0.1], wall_step=0.02, lockstep=lockstep) as robot:
        ros.wait_for(lambda: len(robot.states) > 1, "states")
        answer = trigger_when_heard(ros, "controller/run_trial")
        assert answer.success, answer.message
        assert "4 decisions in 0.4 s" in answer.message
        ros.wait_for(lambda: list(robot.commands[-1].velocity) == [0.0, 0.0], "the end")
    by_stamp = {}
    for command in robot.commands:
        by_stamp.setdefault(nanoseconds(command.header.stamp), []).append(command)
    return robot, by_stamp


def test_a_trial_is_one_decision_per_tick_and_one_command_per_state(ros):
    robot, by_stamp = run_trial(ros, lockstep=True)
    assert np.diff(list(by_stamp)).tolist() == [round(PERIOD * 1e9)] * HORIZON, "x[0] to x[H]"
    states, velocity = dict(robot.states), np.zeros(2)
    for tick, (stamp, commands) in enumerate(by_stamp.items()):
        assert len(commands) == (1 if tick == HORIZON else round(PERIOD / 0.01))
        assert {tuple(command.name) for command in commands} == {tuple(JOINTS)}
        position = np.array([states[stamp][joint] for joint in JOINTS])
        decided = LINEAR.act(np.concatenate([position, velocity]), tick)
        velocity = np.zeros(2) if tick == HORIZON else decided
        for command in commands:
            np.testing.assert_allclose(command.velocity, velocity, atol=1e-12)


def test_a_trial_keeps_its_ticks_on_a_robot_that_waits_for_nobody(ros):
    _, by_stamp = run_trial(ros, lockstep=False)
    stamps = np.array(list(by_stamp)) * 1e-9
    late = stamps - stamps[0] - PERIOD * np.arange(HORIZON + 1)
    assert (late > -1e-9).all()
    assert (late < PERIOD).all(), "states may be lost under load, ticks may not"
    for commands in by_stamp.values():
        assert len({tuple(command.velocity) for command in commands}) == 1
        assert len(commands) <= round(PERIOD / 0.01)


def test_only_velocities_move_the_robot_to_its_start_and_within_its_speed(ros):
    start = [0.4, -0.3]
    parameters = {**ROBOT, "start_position": start, "approach_speed": 0.5}
    ros.start(CONTROLLER, parameters=parameters)
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        ros.wait_for(lambda: robot.states, "states")
        answer = trigger_when_heard(ros, "controller/move_to_start")
        assert answer.success, answer.message
        assert "at the start" in answer.message
    np.testing.assert_allclose(robot.vector("positions"), start, atol=0.002)
    speeds = np.abs([command.velocity for command in robot.commands])
    assert 0.45 < speeds.max() <= 0.5
    assert speeds[0].max() <= 0.05, "the speed builds up"
    assert list(robot.commands[-1].velocity) == [0.0, 0.0]


def test_a_policy_file_runs_without_a_learner_and_with_a_namespace(ros, tmp_path):
    policy = OpenLoopPolicy(np.array([[0.1, -0.2]] * HORIZON), np.array([1.0, 2.0]), 4)
    path = tmp_path / "policy_007.yaml"
    shown = Demonstrated(np.arange(2.0 * HORIZON + 2.0).reshape(-1, 2))
    beside = {**ROBOT, **shown.to_parameters(), "start_position": [0.0, 0.0]}
    write_policy_file(path, policy, Joints(tuple(JOINTS)), beside)
    parameters = {"velocity_controller_output": True}
    controller = ros.start(CONTROLLER, files=[path], parameters=parameters, namespace="/robot")
    topic = "/robot/velocity_controller/commands"
    other = ros.listen(Float64MultiArray, topic, COMMAND_RECORDING, publishers=1)
    reference = ros.listen(
        JointState, "/robot/controller/reference", JOINT_STATES_PUB, publishers=1
    )
    with FakeRobot(ros, JOINTS, topic="/robot/", lockstep=True) as robot:
        ros.wait_for(lambda: robot.states, "states")
        answer = trigger_when_heard(ros, "/robot/controller/run_trial")
        assert answer.success, answer.message
    ros.wait_for(lambda: [*other.messages[-1].data] == [0.0, 0.0], "the other output's end")
    assert {tuple(message.data) for message in other.messages} == {(0.1, -0.2), (0.0, 0.0)}
    ros.wait_for(lambda: len(reference.messages) == HORIZON + 1, "what was shown, at every tick")
    np.testing.assert_array_equal([each.position for each in reference.messages], shown.positions)
    assert {tuple(each.name) for each in reference.messages} == {tuple(JOINTS)}
    stamps = [nanoseconds(each.header.stamp) for each in reference.messages]
    assert np.diff(stamps).tolist() == [round(PERIOD * 1e9)] * HORIZON
    for line in (
        "ready to move 2 joints by velocities; policy open_loop",
        "trial begins",
        "trial over: 4 decisions in 0.4 s",
    ):
        assert controller.output.count(line) == 1, "one line each"
    np.testing.assert_allclose(robot.vector("positions"), [0.04, -0.08], atol=1e-9)


def test_an_effort_robot_gets_efforts(ros):
    parameters = {**ROBOT, "command_interface": "effort", "effort_limit": [1.0, 2.0], **MOVING}
    ros.start(CONTROLLER, parameters={**parameters, "start_position": [0.0, 0.0]})
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        ros.wait_for(lambda: robot.states, "states")
        assert trigger_when_heard(ros, "controller/run_trial").success
        answer = trigger_when_heard(ros, "controller/move_to_start")
    assert "takes velocities" in answer.message
    assert {tuple(command.effort) for command in robot.commands} == {(0.1, -0.2), (0.0, 0.0)}
    assert all(len(command.velocity) == 0 for command in robot.commands)


def test_a_joint_that_goes_missing_stops_the_robot(graph, robot, diagnostics):
    answer = begin_trial(graph, robot, MOVING)

    def drop_wrist(message):
        place = list(message.name).index("wrist")
        for values in (message.name, message.position, message.velocity):
            del values[place]

    robot.distort = drop_wrist
    assert_stopped(graph, robot, answer, "no joint state for 1 s of: wrist", diagnostics)


@pytest.mark.parametrize(
    ("quantity", "value", "reason"),
    [
        ("position", math.nan, "position of joint wrist is nan"),
        ("velocity", math.inf, "velocity of joint wrist is inf"),
    ],
)
def test_a_value_that_is_not_finite_stops_the_robot(
    graph, robot, diagnostics, quantity, value, reason
):
    answer = begin_trial(graph, robot, MOVING)

    def spoil(message):
        getattr(message, quantity)[list(message.name).index("wrist")] = value

    robot.distort = spoil
    assert_stopped(graph, robot, answer, reason, diagnostics)


def test_a_malformed_joint_state_stops_the_robot(graph, robot, diagnostics):
    answer = begin_trial(graph, robot, MOVING)

    def cut(message):
        message.velocity = []

    robot.distort = cut
    reason = "3 names, 3 positions and 0 velocities"
    assert_stopped(graph, robot, answer, reason, diagnostics)


def test_a_joint_near_its_limit_that_moves_on_stops_the_robot(graph, robot, diagnostics):
    robot.positions["wrist"], robot.wall_step = -0.8, 0.01
    answer = begin_trial(graph, robot, table(*[[0.0, -0.5]] * 10))
    reason = "comes within 0.05 rad of its lower limit -1 rad and is moving on"
    assert_stopped(graph, robot, answer, reason, diagnostics)
    assert -1.0 < robot.positions["wrist"] < -0.89, "stopped before its limit"
    # Away from the limit it may go.
    robot.commands.clear()
    answer = begin_trial(graph, robot, table(*[[0.0, 0.5]] * 10))
    graph.wait_for(lambda: robot.positions["wrist"] > -0.8, "the way back")
    graph.trigger("controller/stop")


def test_a_policy_change_stops_the_trial(graph, robot, diagnostics):
    answer = begin_trial(graph, robot, MOVING)
    assert graph.set_parameters("controller", table([0.2, 0.2])).successful
    assert_stopped(graph, robot, answer, "trial stopped: the policy was changed", diagnostics)


def test_a_refused_policy_does_not_disturb_the_trial(graph, robot):
    answer = begin_trial(graph, robot, MOVING)
    too_fast = {**table([0.2, 0.2]), "policy.control_limit": [1.0, 9.0]}
    assert not graph.set_parameters("controller", too_fast).successful
    time.sleep(0.05)
    assert not answer.done()
    graph.trigger("controller/stop")


def test_stop_ends_the_trial(graph, robot, diagnostics):
    answer = begin_trial(graph, robot, MOVING)
    response = graph.trigger("controller/stop")
    assert (response.success, response.message) == (True, "trial stopped")
    assert_stopped(graph, robot, answer, "controller/stop was called", diagnostics)
    assert graph.trigger("controller/stop").message == "nothing was moving"


def test_disabling_stops_the_trial_and_refuses_the_next(graph, robot, diagnostics):
    answer = begin_trial(graph, robot, MOVING)
    off, on = SetBool.Request(data=False), SetBool.Request(data=True)
    assert graph.call(SetBool, "controller/enable", off).message == "disabled"
    assert_stopped(graph, robot, answer, "the controller was disabled", diagnostics)
    assert "the controller is disabled" in graph.trigger("controller/run_trial").message
    assert graph.call(SetBool, "controller/enable", on).message == "enabled"
    robot.commands.clear()
    begin_trial(graph, robot, MOVING)
    graph.trigger("controller/stop")


def test_stamps_that_run_back_or_jump_stop_the_robot(graph, robot, diagnostics):
    answer = begin_trial(graph, robot, MOVING)
    robot.stamp -= 1_500_000_000
    assert_stopped(graph, robot, answer, "ran back by 1.4", diagnostics)
    robot.commands.clear()
    answer = begin_trial(graph, robot, MOVING)
    robot.stamp += 500_000_000
    assert_stopped(graph, robot, answer, "joint states jumped over tick", diagnostics)


def test_a_second_motion_is_refused_as_busy(graph, robot):
    answer = begin_trial(graph, robot, MOVING)
    assert graph.set_parameters("controller", {"start_position": [0.0, 0.0]}).successful
    for service in ("controller/run_trial", "controller/move_to_start"):
        second = graph.trigger(service)
        assert not second.success
        assert "busy: trial is going on" in second.message
    assert not answer.done()
    graph.trigger("controller/stop")


def test_a_start_out_of_reach_fails_with_the_distance(graph, robot, diagnostics):
    robot.distort = lambda message: setattr(message, "position", [0.0, 0.3, 0.3])  # it is stuck
    values = {"start_position": [0.0, 0.0], "approach_timeout": 0.5}
    assert graph.set_parameters("controller", values).successful
    graph.wait_for(lambda: len(robot.states) > 5, "states")
    answer = graph.trigger_async("controller/move_to_start")
    assert_stopped(graph, robot, answer, "not at the start after 0.5 s", diagnostics)
    assert "-0.3000 rad away" in answer.result().message


def test_without_states_policy_or_start_nothing_moves(ros):
    ros.start(CONTROLLER, parameters=ROBOT)
    heard = ros.listen(DiagnosticArray, "/diagnostics", publishers=1)
    assert "there is no policy" in ros.trigger("controller/run_trial").message
    assert "there is no start" in ros.trigger("controller/move_to_start").message
    assert ros.set_parameters("controller", MOVING).successful
    answer = ros.trigger("controller/run_trial")
    assert not answer.success
    assert answer.message == "no joint state yet of: elbow, wrist"
    ros.wait_for(lambda: heard.messages, "diagnostics")
    assert heard.messages[-1].status[0].message == "no joint state yet of: elbow, wrist"


def test_limits_that_are_not_guarded_are_told(ros):
    ros.start(CONTROLLER, parameters={**ROBOT, "position_margin": -0.5})
    heard = ros.listen(DiagnosticArray, "/diagnostics", publishers=1)
    with FakeRobot(ros, JOINTS):
        ros.wait_for(
            lambda: any(
                status.level == DiagnosticStatus.WARN and "limits are not guarded" in status.message
                for message in heard.messages
                for status in message.status
            ),
            "the warning",
        )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_the_robot_before_the_node_ends(ros, number):
    process = ros.start(CONTROLLER, parameters={**LONG, **MOVING})
    with FakeRobot(ros, JOINTS, lockstep=True) as robot:
        answer = begin_trial(ros, robot, MOVING)
        assert process.stop(number) == 0
        ros.wait_for(answer.done, "the answer")
        assert not answer.result().success
        assert "told to end" in answer.result().message
        ros.wait_for(lambda: list(robot.commands[-1].velocity) == [0.0, 0.0], "zero velocity")
        moved = [any(command.velocity) for command in robot.commands]
        assert moved == sorted(moved, reverse=True), "zeros after the movement, nothing else"
