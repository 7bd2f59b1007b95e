"""No motion commands more than the robot's acceleration limit; a trial ends when it has braked."""

import dataclasses

import numpy as np
import pytest

from irlpilco_ros.control.acceleration_limit import AccelerationLimit
from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motion_control import MotionControl
from irlpilco_ros.control.motions import Trial
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import InvalidSettingError

ROBOT = RobotSettings(
    joints=("a", "b"),
    position_lower=(-2.0, -2.0),
    position_upper=(2.0, 2.0),
    velocity_limit=(1.0, 1.0),
    acceleration_limit=(2.0, 4.0),
)
PERIOD = 10_000_000  # [ns]


class Jumping:
    def act(self, state, step):
        return np.array([0.5, -0.5]) * (-1.0) ** step


def commands_of_a_trial(robot):
    control, outcomes = MotionControl(robot, ControllerSettings()), []
    position, commands = np.zeros(2), []
    for k in range(500):
        message = JointStateMessage(k * PERIOD, robot.joints, tuple(position), (0.0, 0.0), ())
        command = control.take(message, k * 0.01)
        if k == 0:
            control.start(Trial(Jumping(), 2, 0.5), 0.0, outcomes.append)
            command = control.take(message, 0.0)
        commands.append(command.values)
        position = position + 0.01 * command.values
        if outcomes:
            assert outcomes[0].succeeded, outcomes[0].message
            return np.array(commands), command
    raise AssertionError("the trial did not end")


def test_commands_do_not_jump_and_the_trial_ends_at_rest():
    commands, last = commands_of_a_trial(ROBOT)
    steps = np.abs(np.diff(np.vstack([np.zeros(2), commands]), axis=0))
    assert (steps <= np.array([2.0, 4.0]) * 0.01 + 1e-12).all()
    assert commands.max(axis=0) == pytest.approx([0.5, 0.5])
    assert last.done
    assert not last.values.any()
    assert len(commands) > 101, "it brakes after the last decision"


def test_without_a_limit_they_are_sent_as_they_are():
    commands, _ = commands_of_a_trial(dataclasses.replace(ROBOT, acceleration_limit=()))
    np.testing.assert_array_equal(commands[0], [0.5, -0.5])
    assert len(commands) == 101


def test_stamps_that_stand_still_or_run_back_give_no_room():
    limit = AccelerationLimit(np.array([1.0]))
    limit.limited(0, np.array([1.0]))
    assert limit.limited(100_000_000, np.array([1.0])) == pytest.approx([0.1])
    assert limit.limited(100_000_000, np.array([1.0])) == pytest.approx([0.1])
    assert limit.limited(50_000_000, np.array([1.0])) == pytest.approx([0.1])
    assert limit.limited(100_000_000, np.array([1.0])) == pytest.approx([0.1])


def test_efforts_have_no_such_limit():
    with pytest.raises(InvalidSettingError, match="command_interface: effort leave it out"):
        dataclasses.replace(ROBOT, command_interface="effort", effort_limit=(5.0, 5.0))
