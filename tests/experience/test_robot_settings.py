"""Robots as settings: what goes together, and the robot that comes with the package."""

from __future__ import annotations

import dataclasses

import pytest

from irlpilco_ros.experience.parameters_file import (
    load_parameters_file,
    settings_from_parameters,
)
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import InvalidSettingError

ROBOT = RobotSettings(
    joints=("elbow", "wrist"),
    position_lower=(-1.0, -1.5),
    position_upper=(1.0, 1.0),
    velocity_limit=(1.0, 2.0),
    effort_limit=(5.0, 3.0),
)


def test_limits_are_arrays_in_the_unit_of_the_interface():
    assert ROBOT.lower.tolist() == [-1.0, -1.5]
    assert ROBOT.upper.tolist() == [1.0, 1.0]
    assert ROBOT.control_limit.tolist() == [1.0, 2.0]
    effort = dataclasses.replace(ROBOT, command_interface="effort")
    assert effort.control_limit.tolist() == [5.0, 3.0]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"joints": ()}, "joints is empty"),
        ({"joints": ("elbow", "elbow")}, "names a joint twice"),
        ({"velocity_limit": (1.0,)}, "velocity_limit has 1 values for 2 joints"),
        ({"position_lower": (0.0, 1.0)}, r"joint wrist are \[1\.0, 1\.0\]"),
        ({"command_interface": "effort", "effort_limit": ()}, "effort_limit has 0 values"),
        ({"sliding_joints": ("hand",)}, "sliding_joints names hand"),
        (
            {"sliding_joints": ("wrist",), "continuous_joints": ("wrist",)},
            "some of RobotSettings.joints that do not turn",
        ),
        ({"control_period": 0.0}, "control_period is 0"),
    ],
)
def test_robot_settings_that_do_not_go_together_are_refused(change, reason):
    with pytest.raises(InvalidSettingError, match=reason):
        dataclasses.replace(ROBOT, **change)


def test_the_robot_of_the_package_loads(repository):
    parameters = load_parameters_file(repository / "config" / "baxter.yaml", "controller")
    robot = settings_from_parameters(RobotSettings, parameters)
    assert len(robot.joints) == 14
    assert robot.control_limit.tolist() == [1.5] * 4 + [4.0] * 3 + [1.5] * 4 + [4.0] * 3
    assert (robot.acceleration_limits >= 5.0).all()
    effort = dataclasses.replace(robot, command_interface="effort", acceleration_limit=())
    assert effort.control_limit[4] == 15.0


def test_a_velocity_limit_that_bounds_nothing_is_doubted_or_refused():
    robot = dataclasses.replace(ROBOT, velocity_limit=(1.5, 100.0))
    [doubt] = robot.doubts()
    assert doubt.startswith("velocity_limit of joint wrist is 100 rad/s")
    # Nobody commands it.
    assert dataclasses.replace(robot, unactuated_joints=("wrist",)).doubts() == ()
    assert ROBOT.doubts() == ()
    with pytest.raises(InvalidSettingError, match=r"expected at most 10000\.0 \[rad/s\]"):
        dataclasses.replace(ROBOT, velocity_limit=(1.5, 1e6))


def test_a_joint_that_turns_without_end_needs_limits_that_it_never_reaches():
    turning = dataclasses.replace(ROBOT, continuous_joints=("wrist",))
    [doubt] = turning.doubts()
    assert doubt.startswith("joint wrist turns without end (continuous_joints), but motions stop")
    wide = dataclasses.replace(turning, position_lower=(-1.0, -1e3), position_upper=(1.0, 1e3))
    assert wide.doubts() == ()
