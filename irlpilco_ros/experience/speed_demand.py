"""Whether a robot is as fast as what it is shown."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.task import Task

_TOLERANCE = 1.02  # what noise and rounding may add to the speed of a demonstration


def too_slow(task: Task, robot: RobotSettings) -> tuple[str, ...]:
    """Return a sentence for each joint whose limit is below the speed that it is shown with.

    What counts is the mean speed between two decisions: a policy holds its command as long.
    """
    if robot.command_interface != "velocity" or not task.demonstrations:
        return ()
    columns = robot.roles.commanded_columns
    speeds = [
        np.abs(np.diff(shown.states[:, columns], axis=0)).max(axis=0) / task.dt
        for shown in task.demonstrations
    ]
    needed = np.max(speeds, axis=0)
    slow = np.flatnonzero(needed > _TOLERANCE * robot.control_limit)
    return tuple(
        f"joint {robot.roles.commanded[joint]} was shown at {needed[joint]:.2f} rad/s, and its "
        f"velocity_limit is {robot.control_limit[joint]:g} rad/s: every policy is slower than the "
        "demonstration there, and stays behind; show it slower, or raise the limit"
        for joint in slow
    )
