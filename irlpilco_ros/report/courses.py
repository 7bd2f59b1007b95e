"""What the robot did between the decisions, from every joint state that was recorded."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.experience.path_quality import MotionPath, path_of
from irlpilco_ros.experience.smoothing import smoothed_states
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints

TRIAL = "trial"
"""Name of the best trial's course."""

_STEP = 0.02
"""Time between two states of a course [s]: shorter than whatever an arm does."""


def course(recorded: Trajectory, joints: Joints, begin: float, seconds: float) -> MotionPath | None:
    """Return the course of a motion without the sensors' noise, or None if it was not recorded.

    Arguments as of `path_of`.

    Raises:
        BagError: a joint was not recorded.
    """
    path = path_of(recorded, joints, begin, seconds)
    if path is None:
        return None
    times = np.linspace(0.0, path.times[-1], round(path.times[-1] / _STEP) + 1)
    states = smoothed_states(path.times, path.positions, path.velocities, times)
    if not np.isfinite(states).all():
        return None
    count = len(joints.names)
    return MotionPath(times, states[:, :count], states[:, count:])


def course_of_trial(recorded: Trajectory, joints: Joints) -> MotionPath | None:
    """Return the course of a whole trial, from first to last command; errors as `course`."""
    decided = recorded.stamps[recorded.commanded]
    return course(recorded, joints, decided[0], decided[-1] - decided[0])
