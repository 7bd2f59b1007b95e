"""Nothing new of the robot, or of the controller itself: the motion ends, on a steady clock."""

from __future__ import annotations

import math
import signal
import time

import pytest
from controlled_robot import CONTROLLER, JOINTS, LONG, MOVING, assert_stopped, begin_trial
from diagnostic_msgs.msg import DiagnosticArray
from fake_robot import FakeRobot

from irlpilco_ros.ros.messages import time_message

pytestmark = pytest.mark.dds

TRIES = 10
BAR = 0.15  # [s] from the robot's last word to zero velocity
RELAXED = {"state_timeout": 1.0, "command_timeout": 1.0}


@pytest.fixture(scope="module")
def graph(shared_ros):
    # As users have it: the tests of LONG itself wait longer.
    strict = {key: value for key, value in LONG.items() if key not in RELAXED}
    shared_ros.controller = shared_ros.start(CONTROLLER, parameters=strict)
    return shared_ros


@pytest.fixture(scope="module")
def diagnostics(graph):
    return graph.listen(DiagnosticArray, "/diagnostics", publishers=1)


def run_undisturbed(graph, robot, seconds=0.3, deadline=60.0):
    """Begin a trial that lasts so long; a busy computer that ends it before gets another try."""
    end = time.monotonic() + deadline
    while time.monotonic() < end:
        robot.commands.clear()
        robot.heard.clear()
        answer = begin_trial_or_none(graph, robot)
        if answer is not None:
            time.sleep(seconds)
            if not answer.done():
                return answer
    raise AssertionError(f"no trial went on for {seconds} s within {deadline} s")


def begin_trial_or_none(graph, robot):
    assert graph.set_parameters("controller", MOVING).successful
    graph.wait_for(lambda: len(robot.states) > 20, "states")
    answer = graph.trigger_async("controller/run_trial")
    graph.wait_for(lambda: len(robot.commands) > 3 or answer.done(), "commands")
    return None if answer.done() else answer


def time_to_stop(graph, robot, spoil, mend):
    """Spoil the joint states in a trial; return the time to zero velocity [s], and the answer.

    The time is infinite if something else had ended the trial before.
    """
    answer = run_undisturbed(graph, robot)
    robot.wait_for_state()
    began = time.monotonic()
    spoil()
    graph.wait_for(answer.done, "the answer")
    graph.wait_for(lambda: not any(robot.commands[-1].velocity), "zero velocity")
    stops = (
        heard - began
        for heard, command in zip(robot.heard, robot.commands, strict=False)
        if heard > began and not any(command.velocity)
    )
    mend()
    return next(stops, math.inf), answer.result()


def silence(robot):
    def spoil():
        robot.is_silent = True

    def mend():
        robot.is_silent = False

    return spoil, mend


def distortion(distort):
    def make(robot):
        def spoil():
            state = {"stamp": robot.stamp}
            robot.distort = lambda message: distort(message, robot, state)

        def mend():
            robot.distort = lambda message: None

        return spoil, mend

    return make


def freeze(message, robot, state):
    message.header.stamp = time_message(state["stamp"])


def run_back(message, robot, state):
    message.header.stamp = time_message(2 * state["stamp"] - robot.stamp)


def saw(message, robot, state):
    message.header.stamp = time_message(state["stamp"] - 20_000_000 - robot.stamp % 100_000_000)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (silence, "no joint state for 0.12 s of: elbow, wrist"),
        (distortion(freeze), "stamps do not advance"),
        (distortion(run_back), "stamps do not advance"),
        (distortion(saw), "stamps do not advance"),
    ],
    ids=["silence", "frozen", "back", "saw"],
)
def test_zero_velocity_comes_in_time(graph, fault, reason):
    """At the best of some tries: what a busy computer adds to it is not the controller's."""
    tries = []
    with FakeRobot(graph, JOINTS, wall_step=0.01) as robot:
        for _ in range(TRIES):
            seconds, answer = time_to_stop(graph, robot, *fault(robot))
            assert not answer.success
            tries.append((seconds, answer.message))
            if 0.1 < seconds < BAR and reason in answer.message:
                return
            robot.positions.update(dict.fromkeys(JOINTS, 0.0))
    raise AssertionError(tries)


def test_a_motion_waits_a_moment_for_a_robot_that_is_silent_when_it_is_called(graph):
    with FakeRobot(graph, JOINTS, wall_step=0.01) as robot:
        assert graph.set_parameters("controller", MOVING).successful
        graph.wait_for(lambda: len(robot.states) > 20, "states")

        def begins() -> bool:
            robot.is_silent = True
            time.sleep(0.2)
            answer = graph.trigger_async("controller/run_trial")
            time.sleep(0.2)
            robot.is_silent = False
            count = len(robot.commands)
            graph.wait_for(lambda: answer.done() or len(robot.commands) > count + 3, "commands")
            return not answer.done()

        graph.wait_for(begins, "a trial")
        graph.trigger("controller/stop")


def test_stamps_that_are_zero_from_the_start_move_nothing(graph):
    with FakeRobot(graph, JOINTS, wall_step=0.01) as robot:
        robot.distort = lambda message: setattr(message.header, "stamp", time_message(0))
        assert graph.set_parameters("controller", MOVING).successful
        graph.wait_for(lambda: len(robot.states) > 50, "states")
        answer = graph.trigger("controller/run_trial")
        assert not answer.success
        assert "stamps do not advance" in answer.message
        assert "0.000 s" in answer.message
        assert robot.commands == []


@pytest.mark.parametrize("seconds", [0.3, 0.7])
def test_a_controller_that_was_stopped_itself_ends_the_trial(graph, diagnostics, seconds):
    """No try succeeds; one at least is not disturbed by how busy the computer is."""
    tries = []
    with FakeRobot(graph, JOINTS, wall_step=0.01) as robot:
        for _ in range(TRIES):
            answer = run_undisturbed(graph, robot)
            graph.controller.send(signal.SIGSTOP)
            time.sleep(seconds)
            count = len(robot.commands)
            graph.controller.send(signal.SIGCONT)
            graph.wait_for(answer.done, "the answer")
            message = answer.result().message
            assert not answer.result().success
            graph.wait_for(lambda: not any(robot.commands[-1].velocity), "zero velocity")
            jerks = sum(any(command.velocity) for command in robot.commands[count:])
            if "no command went out for" in message and "held up?" in message and jerks == 0:
                return
            tries.append((jerks, message))
            robot.positions.update(dict.fromkeys(JOINTS, 0.0))
    raise AssertionError(tries)


def test_a_joint_beyond_its_limit_stops_the_robot_whatever_is_commanded(graph, diagnostics):
    """A try that a busy computer ends by its silence tells nothing of the limit."""
    tries = []
    with FakeRobot(graph, JOINTS, wall_step=0.01) as robot:
        for _ in range(TRIES):
            answer = run_undisturbed(graph, robot)
            robot.positions["wrist"] = 1.02  # the trial moves it back
            graph.wait_for(answer.done, "the answer")
            tries.append(answer.result().message)
            if "joint wrist is at 1.0" in tries[-1]:
                assert_stopped(graph, robot, answer, "joint wrist is at 1.0", diagnostics)
                assert "beyond its upper limit 1 rad" in tries[-1]
                return
            robot.positions.update(dict.fromkeys(JOINTS, 0.0))
    raise AssertionError(tries)


def test_a_waiting_simulation_may_stand_still_and_repeat_itself(graph):
    with FakeRobot(graph, JOINTS, lockstep=True) as robot:
        answer = begin_trial(graph, robot, MOVING)
        robot.is_deaf = True
        time.sleep(0.6)
        assert not answer.done()
        robot.is_deaf = False
        graph.trigger("controller/stop")
