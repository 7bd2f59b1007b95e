"""Mean and variance of each GP output at a Gaussian input, with their derivatives.

The formulas are those of moment matching (2.34-2.45, Deisenroth & Rasmussen 2011), written with
z_i = x_i - m, Lambda = diag(l^2), P1 = (Lambda + S)^-1 and P2 = (Lambda + 2S)^-1:

    t_i = P1 z_i                 q_i = beta_i s^2 |I + S/Lambda|^-1/2 exp(-1/2 z_i't_i)
    M = sum q                    V = E[df/dx] = sum q_i t_i
    Hess = E[d2f/dx2] = sum q_i t_i t_i' - M P1
    dM/dm = V                    dM/dS = Hess / 2                    dV/dm = Hess

    G = (Lambda^-1 - P2) / 2     e_i = log s^2 - 1/4 log|I + 2S/Lambda|
                                       - 1/2 z_i'Lambda^-1 z_i + 1/2 z_i'G z_i
    Q_ij = (beta_i beta_j - K^-1_ij) exp(e_i + e_j + z_i'G z_j)      r = Q1
    v = sum Q + s^2 - M^2
    dv/dm = 2 P2 Z'r - 2 M V     dv/dS = P2 Z'(diag(r) + Q)Z P2 - (sum Q) P2 - M Hess

So a variance with all its derivatives takes one n x n exponential and two n x n x P products,
and nothing of size n x n is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gaussian import Array
from irlpilco_ros.learning.linear_algebra import regularised_inverse
from irlpilco_ros.learning.posterior import Posterior
from irlpilco_ros.learning.threads import scratch

SMALLEST_EXPONENT = -500.0
"""Exponents are clipped here: exp(-500) is nothing, but denormal numbers are 20 times slower."""


@dataclass(frozen=True)
class MeanMoments:
    """E[f] and its derivatives, for b outputs.

    Attributes:
        mean: M, of shape (b,).
        jacobian: V, of shape (b, P).
        hessian: Hess, of shape (b, P, P).
        precision: P1, of shape (b, P, P).
        slopes: t, of shape (b, n, P).
        shares: q, of shape (b, n).
    """

    mean: Array
    jacobian: Array
    hessian: Array
    precision: Array
    slopes: Array
    shares: Array

    def pullback(self, mean_bar: Array, jacobian_bar: Array) -> tuple[Array, Array]:
        """Pull derivatives by M (b,) and V (b, P) back to m (P,) and S (P, P).

        V_bar gives m_bar = Hess V_bar and, with the third expected derivative of f,
        S_bar = 1/2 sum q_i (t_i'V_bar) t_i t_i' - 1/2 (V_bar'V) P1 - P1 V_bar V'.
        """
        along = (self.slopes @ jacobian_bar[:, :, None])[:, :, 0]
        along += mean_bar[:, None]
        along *= 0.5 * self.shares
        weighted = self.slopes * along[:, :, None]
        matrices = np.swapaxes(self.slopes, 1, 2) @ weighted
        dots = np.sum(jacobian_bar * self.jacobian, axis=1) + mean_bar * self.mean
        matrices -= 0.5 * dots[:, None, None] * self.precision
        sides = (self.precision @ jacobian_bar[:, :, None])[:, :, 0]
        covariance_bar = matrices.sum(axis=0) - sides.T @ self.jacobian
        tilts = (self.hessian @ jacobian_bar[:, :, None])[:, :, 0]
        return mean_bar @ self.jacobian + tilts.sum(axis=0), covariance_bar


@dataclass(frozen=True)
class VarianceMoments:
    """var[f] and its derivatives, for b outputs.

    Attributes:
        variance: v, of shape (b,).
        by_mean: dv/dm, of shape (b, P).
        by_covariance: dv/dS, of shape (b, P, P), symmetric.
    """

    variance: Array
    by_mean: Array
    by_covariance: Array


def mean_moments(block: Posterior, mean: Array, covariance: Array) -> MeanMoments:
    """Return E[f] and its derivatives for the outputs of a block.

    Args:
        block: Posterior of b outputs.
        mean: Mean of the input, of shape (P,).
        covariance: Covariance of the input, of shape (P, P).
    """
    z = block.points - mean
    precision, log_determinant = regularised_inverse(covariance, block.lengthscales_squared)
    slopes = z @ precision
    exponents = -0.5 * np.sum(slopes * z, axis=2)
    exponents += (np.log(block.signal_variance) - 0.5 * log_determinant)[:, None]
    shares = block.weights * np.exp(np.maximum(exponents, SMALLEST_EXPONENT))
    value = shares.sum(axis=1)
    weighted = slopes * shares[:, :, None]
    hessian = np.swapaxes(slopes, 1, 2) @ weighted
    hessian -= value[:, None, None] * precision
    return MeanMoments(value, weighted.sum(axis=1), hessian, precision, slopes, shares)


def variance_moments(
    block: Posterior, mean: Array, covariance: Array, first: MeanMoments, gradient: bool
) -> VarianceMoments:
    """Return var[f] and its derivatives for the outputs of a block.

    Args:
        block: Posterior of b outputs.
        mean: Mean of the input, of shape (P,).
        covariance: Covariance of the input, of shape (P, P).
        first: What `mean_moments` returned for the same block and input.
        gradient: False leaves the derivatives empty.
    """
    z = block.points - mean
    precision, log_determinant = regularised_inverse(2.0 * covariance, block.lengthscales_squared)
    left, right = _exponent_factors(block, z, precision, log_determinant)
    b, n = block.weights.shape
    pairs = np.matmul(left, np.swapaxes(right, 1, 2), out=scratch("pairs", (b, n, n)))
    if _may_be_denormal(block, z):
        np.maximum(pairs, SMALLEST_EXPONENT, out=pairs)
    np.exp(pairs, out=pairs)
    pairs *= block.pair_weights
    size = z.shape[2]
    if not gradient:
        total = pairs.sum(axis=(1, 2))
        variance = total + block.signal_variance - first.mean**2
        return VarianceMoments(variance, np.empty((b, 0)), np.empty((b, 0, 0)))
    products = pairs @ right[:, :, : size + 1]
    rows = products[:, :, size]
    total = rows.sum(axis=1)
    moment = products[:, :, :size] + rows[:, :, None] * z
    second = np.swapaxes(z, 1, 2) @ moment
    by_covariance = precision @ second @ precision
    by_covariance -= total[:, None, None] * precision
    by_covariance -= first.mean[:, None, None] * first.hessian
    by_mean = (precision @ (np.swapaxes(z, 1, 2) @ rows[:, :, None]))[:, :, 0]
    by_mean -= first.mean[:, None] * first.jacobian
    return VarianceMoments(
        total + block.signal_variance - first.mean**2, 2.0 * by_mean, by_covariance
    )


def _exponent_factors(
    block: Posterior, z: Array, precision: Array, log_determinant: Array
) -> tuple[Array, Array]:
    """Return [ZG, e, 1] and [Z, 1, e]: their product is e_i + e_j + z_i'G z_j."""
    b, n = block.weights.shape
    size = z.shape[2]
    inverse_squares = 1.0 / block.lengthscales_squared
    g = -0.5 * precision
    g[:, range(size), range(size)] += 0.5 * inverse_squares
    left = scratch("left", (b, n, size + 2))
    right = scratch("right", (b, n, size + 2))
    np.matmul(z, g, out=left[:, :, :size])
    exponents = 0.5 * np.sum(left[:, :, :size] * z, axis=2)
    exponents -= 0.5 * ((z * z) @ inverse_squares[:, :, None])[:, :, 0]
    exponents += (np.log(block.signal_variance) - 0.25 * log_determinant)[:, None]
    left[:, :, size] = exponents
    left[:, :, size + 1] = 1.0
    right[:, :, :size] = z
    right[:, :, size] = 1.0
    right[:, :, size + 1] = exponents
    return left, right


def _may_be_denormal(block: Posterior, z: Array) -> bool:
    """Whether an exponent could lie below the limit; G >= 0 bounds it from below."""
    distances = (z * z) @ (1.0 / block.lengthscales_squared)[:, :, None]
    lowest = 2.0 * np.log(block.signal_variance).min() - distances.max()
    return bool(lowest < SMALLEST_EXPONENT + 100.0)
