"""Squashing (thesis (4.8)): a smooth limit on controls whose moments have a closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.trigonometric import sine_moments
from irlpilco_ros.learning.numerics.arrays import Array

_STRETCH = np.array([1.0, 3.0])
"""Multiples of v whose sines are mixed."""

_MIX = np.array([9.0 / 8.0, 1.0 / 8.0])

SquashPullback = Callable[[Array, Array, Array], tuple[Array, Array, Array]]


def squash(values: Array, limit: Array) -> Array:
    """Return limit * (9 sin v + sin 3v) / 8 (thesis (4.8)): never beyond the limit.

    Args:
        values: Anything, shape (..., F).
        limit: Largest absolute value of each control, shape (F,).
    """
    return limit * ((9.0 / 8.0) * np.sin(values) + (1.0 / 8.0) * np.sin(3.0 * values))


def unsquash(controls: Array, limit: Array, saturation: float = 0.95) -> Array:
    """Return v in [-pi/2, pi/2] with squash(v) = control, for controls within the limit.

    Args:
        controls: Wanted controls, shape (..., F).
        limit: Largest absolute value of each control, shape (F,), positive.
        saturation: Controls beyond this part of the limit are cut off, since the slope of the
            squashing vanishes at the limit.
    """
    grid = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2001)
    ratio = np.clip(controls / limit, -saturation, saturation)
    return np.interp(ratio, squash(grid, np.ones(1)), grid)


def squashing_slope(mean: Array, variance: Array, limit: Array) -> Array:
    """Return the expected slope of squash(v) at v ~ N(mean, variance), all of shape (F,)."""
    first = 9.0 * np.exp(-0.5 * variance) * np.cos(mean)
    third = 3.0 * np.exp(-4.5 * variance) * np.cos(3.0 * mean)
    slope: Array = limit * (first + third) / 8.0
    return slope


def squashed_moments(raw: Moments, limit: Array) -> tuple[Moments, SquashPullback]:
    """Return the moments of squash(v) for v ~ N(raw.mean, raw.covariance), exactly.

    sin v and sin 3v are jointly sines of a Gaussian of twice the size.

    Args:
        raw: The controls before squashing: mean (F,), covariance (F, F), Jacobian (F, D).
        limit: Largest absolute value of each control, shape (F,).

    Returns:
        The squashed moments with the Jacobian chained, and a pullback to the raw moments' mean,
        covariance and Jacobian.
    """
    size = len(raw.mean)
    sines, pull_sines = sine_moments(
        Gaussian((_STRETCH[:, None] * raw.mean).ravel(), _spread_out(raw.covariance, _STRETCH))
    )
    weigh = limit[:, None] * limit
    slope = limit * ((_MIX * _STRETCH) @ sines.jacobian.diagonal().reshape(2, size))
    moments = Moments(
        limit * (_MIX @ sines.mean.reshape(2, size)),
        weigh * _gathered(sines.covariance, _MIX),
        slope[:, None] * raw.jacobian,
    )

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array, Array]:
        slope_bar = limit * (jacobian_bar * raw.jacobian).sum(axis=1)
        v_bar, v_covariance_bar = pull_sines(
            (_MIX[:, None] * (limit * mean_bar)).ravel(),
            _spread_out(weigh * covariance_bar, _MIX),
            np.diag(((_MIX * _STRETCH)[:, None] * slope_bar).ravel()),
        )
        return (
            _STRETCH @ v_bar.reshape(2, size),
            _gathered(v_covariance_bar, _STRETCH),
            slope[:, None] * jacobian_bar,
        )

    return moments, pullback


def _spread_out(matrix: Array, factors: Array) -> Array:
    """Return the blocks f_i f_j X, as one matrix of twice the size of X."""
    blocks = np.outer(factors, factors)[:, None, :, None] * matrix[:, None, :]
    return blocks.reshape(2 * len(matrix), -1)


def _gathered(matrix: Array, factors: Array) -> Array:
    """Return the sum of f_i f_j X_ij over the blocks X_ij of a matrix of twice their size."""
    size = len(matrix) // 2
    rows = factors[0] * matrix[:size] + factors[1] * matrix[size:]
    gathered: Array = factors[0] * rows[:, :size] + factors[1] * rows[:, size:]
    return gathered
