"""Whether a policy is as fast as what it is to imitate."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.task import Task

_TOLERANCE = 1.02  # what noise and rounding may add to the speed of a demonstration


def too_slow(task: Task, policy: Policy, robot: RobotSettings) -> str:
    """Name the joints whose limit is below the speed that they were shown with; empty if none is.

    What counts is the mean speed between two decisions: a policy holds its command as long.
    """
    if robot.command_interface != "velocity" or not task.demonstrations:
        return ""
    columns = robot.roles.commanded_columns
    speeds = [
        np.abs(np.diff(shown.states[:, columns], axis=0)).max(axis=0) / task.dt
        for shown in task.demonstrations
    ]
    needed, limit = np.max(speeds, axis=0), policy.control_limit
    slow = np.flatnonzero(needed > _TOLERANCE * limit)
    if not slow.size:
        return ""
    joints = ", ".join(
        f"{robot.roles.commanded[joint]} at {needed[joint]:.2f} rad/s, where it may go "
        f"{limit[joint]:g}"
        for joint in slow
    )
    return (
        f"the policy is slower than its demonstration needs: {joints}; it stays behind there. Show "
        "it slower, or raise velocity_limit"
    )
