"""One motion at several speeds: what was at which time of one trial, at the times of another."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.task import Task


def at_moments_of(task: Task, own: Task, values: Array) -> Array:
    """Return what is told at the ticks of one task at those moments of the motion of another.

    Args:
        task: Whose ticks are asked for, t = 0..H.
        own: Whose ticks the values are told at.
        values: Shape (own H + 1, k).

    Returns:
        Shape (H + 1, k), on straight lines between the ticks; the last ones after the end.
    """
    return _at(_moments(task, own), values)


def ways_at_pace_of(task: Task, own: Task, speeds: Array) -> Array:
    """Return speeds of one task, scaled so that they go the same ways in those of another.

    Args:
        task: Whose control periods are asked for, H of them.
        own: Whose control periods the speeds are the means of.
        speeds: Shape (own H, F); after its end nothing moves.

    Returns:
        Shape (H, F).
    """
    ways = np.vstack([np.zeros_like(speeds[:1]), np.cumsum(speeds, axis=0)])
    return np.diff(_at(_moments(task, own), ways), axis=0)


def _moments(task: Task, own: Task) -> Array:
    """Return where the ticks of a task are among those of another, shape (H + 1,)."""
    moments: Array = task.speed / own.speed * np.arange(task.horizon + 1.0)
    return moments


def _at(places: Array, values: Array) -> Array:
    ticks = np.arange(float(len(values)))
    return np.stack([np.interp(places, ticks, column) for column in values.T], axis=1)
