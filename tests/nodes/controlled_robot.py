"""The robot of two joints that the tests of the controller's process have, and its policies."""

from __future__ import annotations

import time

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus

from irlpilco_ros.experience.policy_file import policy_to_parameters
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import OpenLoopPolicy

CONTROLLER = "irlpilco_ros.nodes.controller"
JOINTS = ["elbow", "wrist"]
ROLES = Joints(tuple(JOINTS))
HORIZON = 4
PERIOD = 0.1
ROBOT = {
    "joints": JOINTS,
    "position_lower": [-1.0, -1.0],
    "position_upper": [1.0, 1.0],
    "velocity_limit": [1.0, 2.0],
    "control_period": PERIOD,
    "horizon": HORIZON,
    # The robot is a thread of this process, which a busy computer may keep silent for a while.
    "state_timeout": 1.0,
    "command_timeout": 1.0,
}


def table(*rows):
    """A policy that sends these rows, joints in order."""
    return policy_to_parameters(OpenLoopPolicy(np.array(rows), np.array([1.0, 2.0]), 4), ROLES)


MOVING = table(*[[0.1, -0.2]] * HORIZON)
LONG = {**ROBOT, "horizon": 1000}  # a trial that does not end by itself


def begin_trial(graph, robot, policy):
    """Start a trial and wait until the robot moves; return the future answer.

    The controller may not have heard of this robot yet, and refuse: then it is asked again.
    """
    assert graph.set_parameters("controller", policy).successful
    graph.wait_for(lambda: len(robot.states) > 5, "states")
    refusals = []

    def begun():
        answer = graph.trigger_async("controller/run_trial")
        count = len(robot.commands)
        graph.wait_for(lambda: len(robot.commands) > count + 3 or answer.done(), "commands")
        if not answer.done():
            return answer
        refusals.append(answer.result().message)
        assert "no joint state" in refusals[-1], refusals
        return None

    return graph.wait_for(begun, "a trial")


def is_told(diagnostics, reason, levels=(DiagnosticStatus.ERROR,)):
    """Whether /diagnostics has given this reason, at one of these levels."""
    return any(
        status.level in levels and reason in status.message
        for message in diagnostics.messages
        for status in message.status
    )


def assert_stopped(graph, robot, answer, reason, diagnostics):
    """The answer and /diagnostics give the reason, and zero velocity was the last command."""
    graph.wait_for(answer.done, "the answer")
    response = answer.result()
    assert not response.success
    assert reason in response.message
    graph.wait_for(lambda: is_told(diagnostics, reason), f"diagnostics that say {reason!r}")
    graph.wait_for(lambda: list(robot.commands[-1].velocity) == [0.0, 0.0], "zero velocity")

    def is_quiet():
        """On a busy computer some commands are still under way when the answer has come."""
        count = len(robot.commands)
        time.sleep(0.05)
        return len(robot.commands) == count

    graph.wait_for(is_quiet, "nothing to be published: it is idle")
    assert list(robot.commands[-1].velocity) == [0.0, 0.0]


def trigger_when_heard(ros, service):
    """Call a service until the controller has heard the robot, which takes it a while to find."""

    def answer():
        response = ros.trigger(service)
        return None if response.message.startswith("no joint state yet") else response

    return ros.wait_for(answer, "the controller to hear the robot")
