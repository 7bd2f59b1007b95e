"""Sines and cosines of Gaussian variables, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, Pullback
from irlpilco_ros.learning.numerics.arrays import Array, symmetric


def sine_moments(angles: Gaussian) -> tuple[Moments, Pullback]:
    """Return the exact moments of sin(a), elementwise, for a ~ N(m, S).

    E sin a = exp(-s/2) sin m with the variances s, and with p_ij = exp(-(s_i + s_j)/2)
    cov(sin a_i, sin a_j) = p_ij (sinh(S_ij) cos m_i cos m_j + (cosh(S_ij) - 1) sin m_i sin m_j).

    Args:
        angles: Mean (..., k) and covariance (..., k, k) [rad]; the covariance may be singular.

    Returns:
        Moments with mean (..., k), covariance (..., k, k) and diagonal Jacobian (..., k, k), and
        their pullback.
    """
    m, S = angles.mean, angles.covariance
    variances = S.diagonal(axis1=-2, axis2=-1)
    damping = np.exp(-0.5 * variances)
    sine, cosine = np.sin(m), np.cos(m)
    mean, slope = damping * sine, damping * cosine
    odd, even, both = _damped_hyperbolics(S, variances)
    sines = sine[..., :, None] * sine[..., None, :]
    cosines = cosine[..., :, None] * cosine[..., None, :]
    covariance = odd * cosines + even * sines
    own = range(m.shape[-1])

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        slope_bar = jacobian_bar.diagonal(axis1=-2, axis2=-1)
        bar = symmetric(covariance_bar)
        m_bar = mean_bar * slope - slope_bar * mean
        m_bar += 2.0 * cosine * (bar * even * sine[..., None, :]).sum(axis=-1)
        m_bar -= 2.0 * sine * (bar * odd * cosine[..., None, :]).sum(axis=-1)
        S_bar = bar * ((even + both) * cosines + odd * sines)
        S_bar[..., own, own] -= (bar * covariance).sum(axis=-1)
        S_bar[..., own, own] -= 0.5 * (mean_bar * mean + slope_bar * slope)
        return m_bar, S_bar

    jacobian = np.zeros_like(S)
    jacobian[..., own, own] = slope
    return Moments(mean, covariance, jacobian), pullback


def _damped_hyperbolics(S: Array, variances: Array) -> tuple[Array, Array, Array]:
    """Return p sinh S, p (cosh S - 1) and p = exp(-(s_i + s_j)/2), without cancellation.

    Nor do they overflow: |S_ij| is at most (s_i + s_j)/2, so that only factors could, not products.
    """
    half_sum = 0.5 * (variances[..., :, None] + variances[..., None, :])
    both = np.exp(-half_sum)
    if np.abs(S).max(initial=0.0) < 1.0:
        plus, minus = both * np.expm1(S), both * np.expm1(-S)
    else:
        small = np.where(np.abs(S) < 1.0, S, 0.0)
        plus = np.where(small == S, both * np.expm1(small), np.exp(S - half_sum) - both)
        minus = np.where(small == S, both * np.expm1(-small), np.exp(-S - half_sum) - both)
    return 0.5 * (plus - minus), 0.5 * (plus + minus), both


def sine_cosine_moments(state: Gaussian, angles: Sequence[int]) -> tuple[Moments, Pullback]:
    """Return the exact moments of (sin x_i, cos x_i), interleaved over the listed angles.

    Args:
        state: Mean (..., D) and covariance (..., D, D).
        angles: Indices of the A angles in the state.

    Returns:
        Moments with mean (..., 2A), covariance (..., 2A, 2A), Jacobian (..., 2A, D), and their
        pullback.
    """
    selection, quarter = _sine_cosine_selection(tuple(angles), state.mean.shape[-1])
    sines, pull_sines = sine_moments(
        Gaussian(state.mean @ selection.T + quarter, selection @ state.covariance @ selection.T)
    )

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        angle_bar, angle_covariance_bar = pull_sines(
            mean_bar, covariance_bar, jacobian_bar @ selection.T
        )
        return angle_bar @ selection, selection.T @ angle_covariance_bar @ selection

    return Moments(sines.mean, sines.covariance, sines.jacobian @ selection), pullback


@lru_cache(maxsize=16)
def _sine_cosine_selection(angles: tuple[int, ...], size: int) -> tuple[Array, Array]:
    """Return what picks every angle twice (2A, size), and the phases (2A,) of sin and cos."""
    index = np.repeat(np.asarray(angles, dtype=int), 2)
    selection = np.zeros((len(index), size))
    selection[np.arange(len(index)), index] = 1.0
    return selection, np.tile([0.0, 0.5 * np.pi], len(angles))  # cos x = sin(x + pi/2)
