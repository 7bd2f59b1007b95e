"""Recordings at the times at which a policy decides, by their stamps alone."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

ON_TICK = 1e-4
"""A sample this near to a tick is taken as it is [s]: no robot moves by more than its noise."""

_SPEED_WINDOW = 0.2  # [s] over which speeds are measured where none are published


def resample(times: Array, positions: Array, velocities: Array, ticks: Array) -> Array:
    """Return the states at given times, by cubic Hermite interpolation between the samples.

    Between samples k and k + 1, h apart, with s = (t - t_k) / h,

        q(t) = (1 - s)^2 ((1 + 2 s) q_k + s h v_k) + s^2 ((3 - 2 s) q_k+1 - (1 - s) h v_k+1),

    and velocities are its derivative. Samples that lie on the ticks are given back bit by bit.
    Before the first and behind the last sample the robot stands where it stood, at zero speed.

    Args:
        times: Of the samples (n,), rising [s].
        positions: Shape (n, J) [rad].
        velocities: Shape (n, J) [rad/s].
        ticks: Times that are asked for (m,) [s].

    Returns:
        States [positions, velocities], shape (m, 2J).
    """
    after = np.searchsorted(times, ticks).clip(max=len(times) - 1)
    before = (after - 1).clip(min=0)
    nearest = np.where(ticks - times[before] < times[after] - ticks, before, after)
    exact = np.abs(times[nearest] - ticks) <= ON_TICK
    states = np.hstack([positions, velocities])[nearest]
    outside = ~exact & ((ticks < times[0]) | (ticks > times[-1]))
    states[outside, positions.shape[1] :] = 0.0
    inside = np.flatnonzero(~exact & ~outside)
    if len(inside):
        states[inside] = _hermite(times, positions, velocities, ticks[inside])
    return states


def _hermite(times: Array, positions: Array, velocities: Array, ticks: Array) -> Array:
    k = np.searchsorted(times, ticks) - 1
    h = (times[k + 1] - times[k])[:, None]
    s = (ticks - times[k])[:, None] / h
    q, v = (positions[k], positions[k + 1]), (velocities[k], velocities[k + 1])
    at = (1 - s) ** 2 * ((1 + 2 * s) * q[0] + s * h * v[0])
    at += s**2 * ((3 - 2 * s) * q[1] - (1 - s) * h * v[1])
    speed = 6 * s * (1 - s) * (q[1] - q[0]) / h
    speed += (1 - s) * (1 - 3 * s) * v[0] + s * (3 * s - 2) * v[1]
    return np.hstack([at, speed])


def measured_velocities(times: Array, positions: Array) -> Array:
    """Return the speeds of joints (n, J) [rad/s] from their positions (n, J) at times (n,) [s].

    Differences over 0.2 s, so that noise makes no speed. Where samples are farther apart, the
    slope of the parabola through a sample and its neighbours.
    """
    count, last = np.arange(len(times)), len(times) - 1
    if last < 1:
        return np.zeros_like(positions)
    half = 0.5 * _SPEED_WINDOW + ON_TICK
    before = np.searchsorted(times, times - half)
    after = np.searchsorted(times, times + half, side="right") - 1
    before = np.minimum(before, np.maximum(count - 1, 0))
    after = np.maximum(after, np.minimum(count + 1, last))
    behind, ahead = (times - times[before])[:, None], (times[after] - times)[:, None]
    whole = positions[after] - positions[before]
    speeds: Array = whole / (behind + ahead)
    coarse = np.flatnonzero((before == count - 1) & (after == count + 1))
    h, g = behind[coarse], ahead[coarse]
    first = (positions[coarse] - positions[coarse - 1]) / h
    second = (positions[coarse + 1] - positions[coarse]) / g
    speeds[coarse] = (first * g + second * h) / (h + g)
    return speeds
