"""What stands between a command and the robot."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from robot_of_two import JOINTS, ROBOT, reading

from irlpilco_ros.control.motions import MotionStoppedError
from irlpilco_ros.control.safety import (
    check_command,
    check_policy,
    check_positions,
    check_reading,
    check_start,
)
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import OpenLoopPolicy, RbfPolicy

EFFORT = dataclasses.replace(ROBOT, command_interface="effort")
MARGIN = 0.05


def command(values, robot=ROBOT, **state):
    check_command(robot, MARGIN, reading(**state), np.array(values))


def test_commands_within_the_limits_pass():
    command([1.0, -2.0])
    command([5.0, -3.0], EFFORT)


@pytest.mark.parametrize(
    ("robot", "values", "reason"),
    [
        (ROBOT, [0.0, 2.001], r"wrist is 2\.0010 rad/s; its velocity limit is 2 rad/s"),
        (ROBOT, [-1.5, 0.0], r"elbow is -1\.5000 rad/s; its velocity limit is 1 rad/s"),
        (EFFORT, [0.0, -3.1], r"wrist is -3\.1000 Nm; its effort limit is 3 Nm"),
        (ROBOT, [np.nan, 0.0], "elbow is nan; expected a finite number"),
        (ROBOT, [0.0, np.inf], "wrist is inf; expected a finite number"),
    ],
)
def test_a_limit_that_would_be_exceeded_stops(robot, values, reason):
    with pytest.raises(MotionStoppedError, match=reason):
        command(values, robot)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_near_a_position_limit_a_joint_may_only_go_back(joint, side):
    near, away, on = np.zeros(2), np.zeros(2), np.zeros(2)
    near[joint], on[joint], away[joint] = 0.951 * side, 0.01 * side, -0.5 * side
    command(away, positions=near)
    command(np.zeros(2), positions=near)
    command(on, positions=0.999 * near * 0.99)
    with pytest.raises(MotionStoppedError, match=f"joint {JOINTS[joint]} at .* moving on"):
        command(on, positions=near)


def test_a_fast_joint_is_stopped_earlier():
    command([0.0, 0.5], positions=(0.0, 0.8), velocities=(0.0, 0.5))
    with pytest.raises(MotionStoppedError, match="upper limit"):
        command([0.0, 0.5], positions=(0.0, 0.8), velocities=(0.0, 1.6))


def test_with_efforts_the_measured_speed_says_where_a_joint_goes():
    command([1.0, 0.0], EFFORT, positions=(0.96, 0.0), velocities=(-0.1, 0.0))
    with pytest.raises(MotionStoppedError, match="moving on"):
        command([-1.0, 0.0], EFFORT, positions=(0.96, 0.0), velocities=(0.1, 0.0))


def test_readings_must_be_finite():
    check_reading(ROBOT, reading())
    with pytest.raises(MotionStoppedError, match="position of joint wrist is nan"):
        check_reading(ROBOT, reading(positions=(0.0, np.nan)))
    with pytest.raises(MotionStoppedError, match="velocity of joint elbow is -inf"):
        check_reading(ROBOT, reading(velocities=(-np.inf, 0.0)))


def test_a_joint_beyond_its_limit_stops():
    check_positions(ROBOT, MARGIN, reading(positions=(1.0, -1.0)))
    with pytest.raises(
        MotionStoppedError, match=r"elbow is at 1\.0001 rad, beyond its upper limit 1"
    ):
        check_positions(ROBOT, MARGIN, reading(positions=(1.0001, 0.0)))
    check_positions(ROBOT, -0.2, reading(positions=(1.19, -1.19)))
    with pytest.raises(MotionStoppedError, match=r"wrist is at -1\.2100 rad"):
        check_positions(ROBOT, -0.2, reading(positions=(0.0, -1.21)))


def test_policies_must_fit_the_robot():
    policy = OpenLoopPolicy(np.zeros((4, 2)), np.array([1.0, 2.0]), 4)
    check_policy(ROBOT, policy, Joints(JOINTS))
    with pytest.raises(InvalidSettingError, match="in this order: elbow, wrist"):
        check_policy(ROBOT, policy, Joints(("wrist", "elbow")))
    too_fast = OpenLoopPolicy(np.zeros((4, 2)), np.array([1.0, 2.1]), 4)
    with pytest.raises(InvalidSettingError, match=r"wrist is 2\.1; expected at most .* 2"):
        check_policy(ROBOT, too_fast, Joints(JOINTS))
    one = OpenLoopPolicy(np.zeros((4, 1)), np.array([1.0]), 4)
    with pytest.raises(InvalidSettingError, match=r"takes wrist for unactuated .* are no joint"):
        check_policy(ROBOT, one, Joints(JOINTS, unactuated=("wrist",)))


class Faulty(OpenLoopPolicy):
    def act(self, state, step):
        raise ZeroDivisionError("a slip of the pen")


class Wild(OpenLoopPolicy):
    def act(self, state, step):
        return 3.0 * self.control_limit


def test_policies_are_tried_at_the_start_before_a_robot_gets_them():
    limit, names = np.array([1.0, 2.0]), Joints(JOINTS)
    narrow = RbfPolicy(np.zeros((3, 4)), np.ones((3, 2)), np.full((1, 4), -357.0), limit)
    with pytest.raises(InvalidSettingError, match="the rbf policy cannot act at its start"):
        check_policy(ROBOT, narrow, names)
    centre = np.array([[0.2, 0.1, 0.0, 0.0]])  # away from it the distance overflows
    steep = RbfPolicy(centre, np.ones((1, 2)), np.full((1, 4), -354.0), limit)
    check_policy(ROBOT, steep, names, (0.2, 0.1))
    with pytest.raises(InvalidSettingError, match="of the rbf policy is not finite at its start"):
        check_policy(ROBOT, steep, names)
    with pytest.raises(InvalidSettingError, match="cannot act at its start: a slip of the pen"):
        check_policy(ROBOT, Faulty(np.zeros((4, 2)), limit, 4), names)
    with pytest.raises(InvalidSettingError, match="beyond its own control_limit"):
        check_policy(ROBOT, Wild(np.zeros((4, 2)), limit, 4), names)


def test_starts_must_be_inside_the_limits():
    check_start(ROBOT, (), MARGIN)
    check_start(ROBOT, (0.95, -0.95), MARGIN)
    with pytest.raises(InvalidSettingError, match=r"elbow is 0\.96 rad"):
        check_start(ROBOT, (0.96, 0.0), MARGIN)
    with pytest.raises(InvalidSettingError, match="3 values for 2 joints"):
        check_start(ROBOT, (0.0, 0.0, 0.0), MARGIN)


def test_a_gripper_of_a_few_centimetres_has_a_margin_of_its_size():
    gripper = dataclasses.replace(ROBOT, position_lower=(-1.0, 0.0), position_upper=(1.0, 0.04))
    command([0.0, 0.01], gripper, positions=[0.0, 0.037])
    check_start(gripper, (0.0, 0.0021), MARGIN)
    with pytest.raises(MotionStoppedError, match=r"wrist .* within 0\.002 rad of its upper limit"):
        command([0.0, 0.01], gripper, positions=[0.0, 0.0385])
    with pytest.raises(InvalidSettingError, match=r"position_margin = 0\.002 rad"):
        check_start(gripper, (0.0, 0.0019), MARGIN)
