"""A robot of two joints for tests without ROS."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.robot_settings import RobotSettings

JOINTS = ("elbow", "wrist")
ROBOT = RobotSettings(
    joints=JOINTS,
    position_lower=(-1.0, -1.0),
    position_upper=(1.0, 1.0),
    velocity_limit=(1.0, 2.0),
    effort_limit=(5.0, 3.0),
    control_period=0.1,
    horizon=4,
)


def nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)


def reading(time=0.0, positions=(0.0, 0.0), velocities=(0.0, 0.0)) -> JointReading:
    return JointReading(nanoseconds(time), np.array(positions), np.array(velocities))


def sample(time=0.0, positions=(0.0, 0.0), velocities=(0.0, 0.0)) -> JointStateMessage:
    return JointStateMessage(nanoseconds(time), JOINTS, tuple(positions), tuple(velocities))
