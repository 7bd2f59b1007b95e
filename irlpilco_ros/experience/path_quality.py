"""How a motion went between the decisions: errors over the whole path, and how hard it was.

What is imitated is compared at the ticks, where a policy decides. An arm may be elsewhere between
them, and jerk there; both are measured on all that a robot told of itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array

ACCELERATION_WINDOW = 0.05
"""Time over which speeds are compared [s]: accelerations are their difference through it."""

# Stamps around 1e9 s are exact to a microsecond only.
_EXACT = 1e-6


@dataclass(frozen=True)
class MotionPath:
    """A motion at the rate at which the robot told of it.

    Attributes:
        times: Since the motion began, shape (n,), rising [s].
        positions: Shape (n, J) [rad], without wraps of joints that turn without end.
        velocities: Shape (n, J) [rad/s].
    """

    times: Array
    positions: Array
    velocities: Array


@dataclass(frozen=True)
class PathQuality:
    """How a motion went; NaN where a recording is too coarse to tell.

    Attributes:
        rmse: Root mean square over joints and path of the distance to what was shown [rad].
        largest: Largest such distance of a joint [rad].
        acceleration_p99: 99 % of the joints' accelerations are below it [rad/s^2].
        acceleration_max: Largest acceleration of a joint [rad/s^2].
    """

    rmse: float = math.nan
    largest: float = math.nan
    acceleration_p99: float = math.nan
    acceleration_max: float = math.nan


UNKNOWN = PathQuality()
"""Of a motion whose path was not recorded."""


def path_of(
    recorded: Trajectory, joints: Joints, begin: float, seconds: float
) -> MotionPath | None:
    """Return the path in a recording, or None if its states are too far apart to show one.

    Args:
        recorded: What `read_path` returns.
        joints: Joints of the learning problem (J).
        begin: Stamp of the motion's begin [s].
        seconds: How long it takes [s].

    Raises:
        BagError: a joint was not recorded.
    """
    columns = recorded.columns(joints.names)
    times = recorded.stamps - begin
    inside = recorded.observed & (times >= -_EXACT) & (times <= seconds + _EXACT)
    times = times[inside]
    if len(times) < 2 or np.median(np.diff(times)) > ACCELERATION_WINDOW:
        return None
    positions = recorded.positions[inside][:, columns]
    turning = [joints.names.index(name) for name in joints.continuous]
    positions[:, turning] = np.unwrap(positions[:, turning], axis=0)
    return MotionPath(times, positions, recorded.velocities[inside][:, columns])


def path_quality(
    path: MotionPath | None, shown: Sequence[MotionPath | None], joints: Joints
) -> PathQuality:
    """Return how a path was done.

    Args:
        path: The path of a trial, or one that was shown.
        shown: What is to be imitated is the mean of these.
        joints: Joints of the learning problem.
    """
    if path is None:
        return UNKNOWN
    hardness = np.abs(accelerations(path))
    known = [each for each in shown if each is not None]
    off = np.full(1, np.nan)
    if known and len(known) == len(shown):
        off = path.positions - np.mean([_at(each, path.times) for each in known], axis=0)
        turning = [joints.names.index(name) for name in joints.continuous]
        off[:, turning] = np.arctan2(np.sin(off[:, turning]), np.cos(off[:, turning]))
    return PathQuality(
        rmse=float(np.sqrt(np.mean(off**2))),
        largest=float(np.abs(off).max()),
        acceleration_p99=float(np.quantile(hardness, 0.99)) if hardness.size else math.nan,
        acceleration_max=float(hardness.max()) if hardness.size else math.nan,
    )


def accelerations(path: MotionPath) -> Array:
    """Return the joints' accelerations over 0.05 s, from measured speeds, (m, J) [rad/s^2].

    Where states are missing, or no speed was told, there are none.
    """
    later = np.searchsorted(path.times, path.times + ACCELERATION_WINDOW - _EXACT)
    before = np.flatnonzero(later < len(path.times))
    after = later[before]
    passed = path.times[after] - path.times[before]
    near = passed < 2.0 * ACCELERATION_WINDOW
    before, after, passed = before[near], after[near], passed[near]
    found = (path.velocities[after] - path.velocities[before]) / passed[:, None]
    told: Array = found[np.isfinite(found).all(axis=1)]
    return told


def _at(path: MotionPath, times: Array) -> Array:
    """Return the positions (m, J) of a path at these times, on straight lines between states."""
    columns = [np.interp(times, path.times, column) for column in path.positions.T]
    return np.stack(columns, axis=1)
