"""The cost of MC-PILCO's cart-pole: upright is at pi on either side, and turns count."""

from __future__ import annotations

import math

import numpy as np

from irlpilco_ros.learning.costs.state_costs import saturating_loss
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array

_CERTAIN = 1e-12  # [rad^2]: a smaller variance of theta says all the same on which side it is


def either_side_loss(
    state: Gaussian, target: Array, precision: Array
) -> tuple[Array, Array, Array]:
    """Return E[1 - exp(-(z - z*)'W(z - z*)/2)], z = (x, |theta|), and its derivatives.

    Exact: the Gaussian is cut at theta = 0, and each half has a target of its own, (x*, theta*) and
    (x*, -theta*). Of a half, the reward is that of the whole Gaussian times the part on that side
    of what remains of it: N(m', S'), in proportion to N(m, S) exp(-...).

    Args:
        state: Mean (..., 2) and covariance (..., 2, 2) of x [m] and theta [rad].
        target: z*, shape (2,) [m, rad].
        precision: W, symmetric and positive semidefinite, shape (2, 2).

    Returns:
        The loss in [0, 1], shape (...), its derivative by the mean (..., 2) and by the covariance
        (..., 2, 2).
    """
    value = np.ones(state.mean.shape[:-1])
    by_mean, by_covariance = np.zeros_like(state.mean), np.zeros_like(state.covariance)
    for side in (1.0, -1.0):
        own = target * np.array([1.0, side])
        loss, *slopes = saturating_loss(state, own, precision)
        part, *part_slopes = _part_on_side(state, own, precision, side)
        reward = 1.0 - loss
        value -= reward * part
        by_mean += part[..., None] * slopes[0] - reward[..., None] * part_slopes[0]
        by_covariance += part[..., None, None] * slopes[1]
        by_covariance -= reward[..., None, None] * part_slopes[1]
    return value, by_mean, by_covariance


def _part_on_side(
    state: Gaussian, target: Array, precision: Array, side: float
) -> tuple[Array, Array, Array]:
    """Return Phi(side m'_theta / sqrt S'_theta) and its derivatives by m and S."""
    from scipy.special import ndtr  # late: scipy takes as long as all else

    S, deviation = state.covariance, state.mean - target
    # S' = shrink S, and m' - target = shrink (m - target).
    shrink = np.linalg.inv(np.eye(2) + S @ precision)
    pulled = (precision @ shrink @ deviation[..., None])[..., 0]
    row = shrink[..., 1, :]  # of theta
    variance = np.maximum((row * S[..., 1]).sum(axis=-1), _CERTAIN)
    ratio = side * (target[1] + (row * deviation).sum(axis=-1)) / np.sqrt(variance)
    density = np.exp(-0.5 * ratio**2) / math.sqrt(2.0 * math.pi)
    by_theta = (side * density / np.sqrt(variance))[..., None]
    by_variance = (-0.5 * density * ratio / variance)[..., None, None]
    outer = by_theta[..., None] * row[..., :, None] * pulled[..., None, :]
    by_covariance = by_variance * row[..., :, None] * row[..., None, :]
    by_covariance -= 0.5 * (outer + outer.swapaxes(-1, -2))
    return np.asarray(ndtr(ratio)), by_theta * row, by_covariance
