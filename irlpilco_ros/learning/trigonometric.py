"""Sines and cosines of Gaussian variables, in closed form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irlpilco_ros.learning.gaussian import Array, Gaussian, Moments, Pullback


def sine_moments(angles: Gaussian) -> tuple[Moments, Pullback]:
    """Return the exact moments of sin(a), elementwise, for a ~ N(m, S).

    E sin a = exp(-s/2) sin m, and products of sines become sums of cosines of a_i - a_j and
    a_i + a_j, which are Gaussian too.

    Args:
        angles: Mean (k,) and covariance (k, k) [rad]; the covariance may be singular.

    Returns:
        Moments with mean (k,), covariance (k, k) and diagonal Jacobian (k, k), and their pullback.
    """
    m, S = angles.mean, angles.covariance
    variances = np.diagonal(S)
    damping = np.exp(-0.5 * variances)
    mean = damping * np.sin(m)
    slope = damping * np.cos(m)

    half_sum = 0.5 * (variances[:, None] + variances)
    both = np.exp(-half_sum)
    minus = _exp_difference(S, half_sum, both)
    plus = _exp_difference(-S, half_sum, both)
    difference_angle, sum_angle = m[:, None] - m, m[:, None] + m
    covariance = 0.5 * (minus * np.cos(difference_angle) - plus * np.cos(sum_angle))

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        slope_bar = np.diagonal(jacobian_bar)
        bar = 0.5 * (covariance_bar + covariance_bar.T)
        m_bar = mean_bar * slope - slope_bar * mean
        m_bar += (bar * (plus * np.sin(sum_angle) - minus * np.sin(difference_angle))).sum(axis=1)
        S_bar = (
            0.5
            * bar
            * ((minus + both) * np.cos(difference_angle) + (plus + both) * np.cos(sum_angle))
        )
        own = (bar * covariance).sum(axis=1) + 0.5 * (mean_bar * mean + slope_bar * slope)
        S_bar[np.diag_indices_from(S_bar)] -= own
        return m_bar, S_bar

    return Moments(mean, covariance, np.diag(slope)), pullback


def _exp_difference(S: Array, half_sum: Array, both: Array) -> Array:
    """Return exp(S - half_sum) - exp(-half_sum), without cancellation or overflow."""
    small = np.abs(S) < 1.0
    accurate = both * np.expm1(np.where(small, S, 0.0))
    return np.where(small, accurate, np.exp(S - half_sum) - both)


def sine_cosine_moments(state: Gaussian, angles: Sequence[int]) -> tuple[Moments, Pullback]:
    """Return the exact moments of (sin x_i, cos x_i), interleaved over the listed angles.

    Args:
        state: Mean (D,) and covariance (D, D).
        angles: Indices of the A angles in the state.

    Returns:
        Moments with mean (2A,), covariance (2A, 2A), Jacobian (2A, D), and their pullback.
    """
    index = np.repeat(np.asarray(angles, dtype=int), 2)
    quarter = np.tile([0.0, 0.5 * np.pi], len(angles))  # cos x = sin(x + pi/2)
    size = len(state.mean)
    sines, pull_sines = sine_moments(
        Gaussian(state.mean[index] + quarter, state.covariance[np.ix_(index, index)])
    )
    selection = np.zeros((len(index), size))
    selection[np.arange(len(index)), index] = 1.0

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        angle_bar, angle_covariance_bar = pull_sines(
            mean_bar, covariance_bar, jacobian_bar @ selection.T
        )
        return selection.T @ angle_bar, selection.T @ angle_covariance_bar @ selection

    return Moments(sines.mean, sines.covariance, sines.jacobian @ selection), pullback
