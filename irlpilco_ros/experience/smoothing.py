"""States at the ticks, from all that a robot told around them.

A single reading carries the sensors' noise, which a dynamics model would have to take for motion. A
cubic through the positions and velocities of a few hundredths of a second around a tick has several
times less of it, and no delay.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

WINDOW = 0.06
"""How far before and after a tick states count [s]: a hand's motion is a cubic over that time."""

_FEWEST = 5  # states that a cubic is fitted to
_VELOCITY_TIME = 0.1  # [s]: noise of positions by that of velocities, as of most encoders


def smoothed_states(times: Array, positions: Array, velocities: Array, ticks: Array) -> Array:
    """Return the states at the ticks, by a least-squares cubic through the readings around each.

    Args:
        times: Of the readings (n,), rising [s].
        positions: Shape (n, J) [rad].
        velocities: Shape (n, J) [rad/s].
        ticks: Times that are asked for (m,) [s].

    Returns:
        States [positions, velocities], shape (m, 2J); NaN where fewer than five readings are
        around a tick.
    """
    joints = positions.shape[1]
    states = np.full((len(ticks), 2 * joints), np.nan)
    for row, tick in enumerate(ticks):
        near = np.flatnonzero(np.abs(times - tick) <= WINDOW)
        if len(near) < _FEWEST:
            continue
        t = (times[near] - tick) / WINDOW
        one = np.ones_like(t)
        places = np.stack([one, t, t**2, t**3], axis=1)
        speeds = np.stack([0.0 * t, one, 2.0 * t, 3.0 * t**2], axis=1) / WINDOW
        design = np.concatenate([places, _VELOCITY_TIME * speeds])
        seen = np.concatenate([positions[near], _VELOCITY_TIME * velocities[near]])
        found = np.linalg.lstsq(design, seen, rcond=None)[0]
        states[row, :joints], states[row, joints:] = found[0], found[1] / WINDOW
    return states


def slopes(times: Array, values: Array) -> Array:
    """Return how fast values (n, J) change at their times (n,), rising [s].

    By the slope of a least-squares cubic through the values around each; where they are too few,
    by the differences to its neighbours.
    """
    found: Array = np.gradient(values, times, axis=0) if len(times) > 1 else np.zeros_like(values)
    for row, time in enumerate(times):
        near = np.flatnonzero(np.abs(times - time) <= WINDOW)
        if len(near) >= _FEWEST:
            t = (times[near] - time) / WINDOW
            design = np.stack([np.ones_like(t), t, t**2, t**3], axis=1)
            found[row] = np.linalg.lstsq(design, values[near], rcond=None)[0][1] / WINDOW
    return found
