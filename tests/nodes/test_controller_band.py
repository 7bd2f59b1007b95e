"""guard_sigma over DDS: a trial that leaves what was predicted of it stops the robot."""

from __future__ import annotations

import numpy as np
import pytest
from controlled_robot import CONTROLLER, HORIZON, JOINTS, MOVING, PERIOD, ROBOT, assert_stopped
from diagnostic_msgs.msg import DiagnosticArray
from fake_robot import FakeRobot

from irlpilco_ros.experience.predicted_band import DEVIATIONS, POSITIONS, PredictedBand

pytestmark = pytest.mark.dds

SPEEDS = np.array([0.1, -0.2])  # of MOVING
LEAVES = 2.5  # [control periods] after which the wrist is held


def predicted(horizon=HORIZON):
    """What is to be expected of MOVING from 0, known to 1 mrad."""
    positions = PERIOD * np.arange(horizon + 1)[:, None] * SPEEDS
    return PredictedBand(positions, np.full(positions.shape, 1e-3)).to_parameters()


@pytest.fixture(scope="module")
def graph(shared_ros):
    shared_ros.start(CONTROLLER, parameters={**ROBOT, "guard_sigma": 6.0})
    return shared_ros


@pytest.fixture(scope="module")
def diagnostics(graph):
    return graph.listen(DiagnosticArray, "/diagnostics", publishers=1)


@pytest.fixture
def robot(graph):
    with FakeRobot(graph, JOINTS, lockstep=True) as fake:
        graph.wait_for(lambda: len(fake.states) > 5, "states")
        yield fake


def test_a_trial_as_predicted_goes_on_to_its_end(graph, robot):
    assert graph.set_parameters("controller", {**MOVING, **predicted()}).successful
    answer = graph.trigger("controller/run_trial")
    assert answer.success, answer.message


def test_one_that_leaves_the_band_is_stopped_within_two_periods(graph, robot, diagnostics):
    assert graph.set_parameters("controller", {**MOVING, **predicted()}).successful
    held = LEAVES * PERIOD * SPEEDS[1]  # [rad]

    def push(message):
        """The wrist is held where it is from some moment on."""
        wrist = message.name.index("wrist")
        message.position[wrist] = max(message.position[wrist], held)

    robot.distort = push
    begun = len(robot.commands)
    call = graph.trigger_async("controller/run_trial")
    reason = "joint wrist is 0.0300 rad from where it was expected at tick 4, -0.0800 rad"
    assert_stopped(graph, robot, call, reason, diagnostics)
    assert "guard_sigma 6" in call.result().message
    assert len(robot.commands) - begun <= (LEAVES + 2.0) * PERIOD / 0.01


def test_a_prediction_of_another_length_is_refused(graph, robot):
    assert graph.set_parameters("controller", {**MOVING, **predicted(HORIZON + 1)}).successful
    answer = graph.trigger("controller/run_trial")
    assert not answer.success
    assert "has 4 decisions, but 5 were predicted" in answer.message


def test_a_policy_of_which_nothing_was_predicted_runs_unwatched_and_that_is_said(graph, robot):
    assert graph.set_parameters("controller", {**MOVING, **predicted()}).successful
    assert graph.set_parameters("controller", MOVING).successful
    for name in (POSITIONS, DEVIATIONS):
        assert list(graph.get_parameter("controller", name)) == [], "of the policy before"
    assert graph.trigger("controller/run_trial").success
    controller = graph.processes[0]
    graph.wait_for(lambda: "guard_sigma does not watch it" in controller.output, "the warning")
