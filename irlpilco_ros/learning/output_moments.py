"""Mean and variance of each GP output at a Gaussian input, with their derivatives.

The formulas are those of moment matching (2.34-2.45, Deisenroth & Rasmussen 2011), written with
z_i = x_i - m, Lambda = diag(l^2), P1 = (Lambda + S)^-1 and P2 = (Lambda + 2S)^-1:

    q_i = beta_i s^2 |I + S/Lambda|^-1/2 exp(-1/2 z_i'P1 z_i)
    M = sum q                    V = E[df/dx] = P1 sum q_i z_i
    Hess = E[d2f/dx2] = P1 (sum q_i z_i z_i') P1 - M P1
    dM/dm = V                    dM/dS = Hess / 2                    dV/dm = Hess

    G = (Lambda^-1 - P2) / 2     e_i = log s^2 - 1/4 log|I + 2S/Lambda|
                                       - 1/2 z_i'Lambda^-1 z_i + 1/2 z_i'G z_i
    Q_ij = (beta_i beta_j - K^-1_ij) exp(e_i + e_j + z_i'G z_j)      r = Q1
    v = sum Q + s^2 - M^2
    dv/dm = 2 P2 Z'r - 2 M V     dv/dS = P2 Z'(diag(r) + Q)Z P2 - (sum Q) P2 - M Hess

So a variance with all its derivatives takes one n x n exponential and two n x n x P products,
and nothing of size n x n is kept. Q is symmetric: only the part of it on and above its diagonal
blocks is computed, strip by strip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.displacements import Displacements
from irlpilco_ros.learning.gaussian import Array
from irlpilco_ros.learning.linear_algebra import diagonals, regularised_inverse
from irlpilco_ros.learning.posterior import Posterior
from irlpilco_ros.learning.threads import scratch

SMALLEST_EXPONENT = -500.0
"""Exponents are clipped here: exp(-500) is nothing, but denormal numbers are 20 times slower."""


@dataclass(frozen=True)
class OutputMoments:
    """Means and variances of b outputs, and their derivatives.

    Attributes:
        displacements: Of the supporting points from the input's mean.
        mean: M, of shape (b,).
        variance: v, of shape (b,).
        jacobian: V, of shape (b, P).
        hessian: Hess, of shape (b, P, P); empty without gradient.
        precision: P1, of shape (b, P, P).
        shares: q, of shape (b, n).
        variance_by_mean: dv/dm, of shape (b, P); empty without gradient.
        variance_by_covariance: dv/dS, of which the symmetric part counts, of shape (b, P, P);
            empty without gradient.
    """

    displacements: Displacements
    mean: Array
    variance: Array
    jacobian: Array
    hessian: Array
    precision: Array
    shares: Array
    variance_by_mean: Array
    variance_by_covariance: Array

    def pullback(
        self, mean_bar: Array, jacobian_bar: Array, variance_bar: Array
    ) -> tuple[Array, Array]:
        """Pull derivatives by M (b,), V (b, P), v (b,) back to m (P,) and S (P, P), summed over b.

        V_bar gives m_bar = Hess V_bar and, with the third expected derivative of f,
        S_bar = 1/2 sum q_i (t_i'V_bar) t_i t_i' - 1/2 (V_bar'V) P1 - P1 V_bar V', t_i = P1 z_i,
        of which the symmetric part counts.
        """
        size = jacobian_bar.shape[1]
        sides = np.matmul(self.precision, jacobian_bar[:, :, None])[:, :, 0]
        along = self.displacements.linear_forms(sides)
        along += mean_bar[:, None]
        along *= 0.5 * self.shares
        turned = self.displacements.second_moments(along) @ self.precision
        s_bar = self.precision.reshape(-1, size).T @ turned.reshape(-1, size)
        dots = np.sum(jacobian_bar * self.jacobian, axis=1) + mean_bar * self.mean
        s_bar -= _weighted_sum(0.5 * dots, self.precision)
        s_bar -= sides.T @ self.jacobian
        s_bar += _weighted_sum(variance_bar, self.variance_by_covariance)
        m_bar = jacobian_bar.ravel() @ self.hessian.reshape(-1, size)
        m_bar += mean_bar @ self.jacobian
        m_bar += variance_bar @ self.variance_by_mean
        return m_bar, s_bar


def _weighted_sum(weights: Array, stack: Array) -> Array:
    """Return sum_b w_b X_b, for weights (b,) and a stack (b, P, P)."""
    total: Array = (weights @ stack.reshape(len(weights), -1)).reshape(stack.shape[1:])
    return total


def output_moments(
    posterior: Posterior,
    group: slice,
    displacements: Displacements,
    covariance: Array,
    gradient: bool,
) -> OutputMoments:
    """Return means and variances of a group of outputs for an input N(m, covariance).

    Args:
        posterior: Of all outputs.
        group: Which outputs.
        displacements: Of the supporting points from m.
        covariance: S, of shape (P, P).
        gradient: False leaves the variances' derivatives empty.

    Raises:
        NumericalError: if the covariance is indefinite.
    """
    displacements = displacements.select(group)
    squares = posterior.lengthscales_squared[group]
    count = len(squares)
    precisions, log_determinants = regularised_inverse(
        covariance, np.concatenate([squares, 0.5 * squares])
    )
    precisions[count:] *= 0.5
    forms = displacements.quadratic_forms(precisions)
    log_signal = np.log(posterior.signal_variance[group])

    exponents = -0.5 * forms[:count]
    exponents += (log_signal - 0.5 * log_determinants[:count])[:, None]
    np.maximum(exponents, SMALLEST_EXPONENT, out=exponents)
    shares = posterior.weights[group] * np.exp(exponents)
    mean = shares.sum(axis=1)

    offsets = log_signal - 0.25 * log_determinants[count:]
    sums = _pair_sums(
        posterior, group, displacements, precisions[count:], forms[count:], offsets, gradient
    )
    variance = sums.total + posterior.signal_variance[group] - mean**2
    return _with_derivatives(displacements, precisions, shares, sums, mean, variance, gradient)


def _with_derivatives(
    displacements: Displacements,
    precisions: Array,
    shares: Array,
    sums: _PairSums,
    mean: Array,
    variance: Array,
    gradient: bool,
) -> OutputMoments:
    """Put the moments together, given P1 and P2 stacked, q, and the sums over Q."""
    count = len(mean)
    weights = np.concatenate([shares, sums.rows]) if gradient else shares
    turns = precisions[: len(weights)]
    first = (turns @ displacements.first_moments(weights)[:, :, None])[:, :, 0]
    jacobian, hessian = first[:count], np.empty((count, 0, 0))
    by_mean, by_covariance = np.empty((count, 0)), np.empty((count, 0, 0))
    if gradient:
        moments = displacements.second_moments(weights)
        moments[count:] += sums.moment
        second = turns @ moments @ turns
        hessian, by_covariance = second[:count], second[count:]
        hessian -= mean[:, None, None] * precisions[:count]
        by_mean = 2.0 * (first[count:] - mean[:, None] * jacobian)
        by_covariance -= sums.total[:, None, None] * precisions[count:]
        by_covariance -= mean[:, None, None] * hessian
    return OutputMoments(
        displacements=displacements,
        mean=mean,
        variance=variance,
        jacobian=jacobian,
        hessian=hessian,
        precision=precisions[:count],
        shares=shares,
        variance_by_mean=by_mean,
        variance_by_covariance=by_covariance,
    )


@dataclass(frozen=True)
class _PairSums:
    """Sums over Q, which itself is not kept.

    Attributes:
        total: sum Q, of shape (b,).
        rows: r = Q1, of shape (b, n); empty without gradient.
        moment: Z'QZ, of shape (b, P, P), of which the symmetric part counts; empty likewise.
    """

    total: Array
    rows: Array
    moment: Array


def _pair_sums(
    posterior: Posterior,
    group: slice,
    displacements: Displacements,
    precision: Array,
    forms: Array,
    offsets: Array,
    gradient: bool,
) -> _PairSums:
    """Return the sums over Q, given P2, z_i'P2 z_i and log s^2 - 1/4 log|I + 2S/Lambda|."""
    left, right, clip = _exponent_factors(
        1.0 / posterior.lengthscales_squared[group], displacements, precision, forms, offsets
    )
    count, size = precision.shape[:2]
    n = forms.shape[1]
    pair_weights = posterior.pair_weights[group]
    rows = np.zeros((count, n))
    products = scratch("products", (count, size + 1, n))
    for start, stop in posterior.strips:
        # The strip's columns, and all rows down to its last column's.
        pairs = scratch("pairs", (count, stop, stop - start))
        np.matmul(np.swapaxes(left[:, :, :stop], 1, 2), right[:, :, start:stop], out=pairs)
        if clip:
            np.maximum(pairs, SMALLEST_EXPONENT, out=pairs)
        np.exp(pairs, out=pairs)
        pairs *= pair_weights[:, :stop, start:stop]
        rows[:, :stop] += pairs @ np.ones(stop - start)
        if gradient:
            np.matmul(displacements.z[:, :, :stop], pairs, out=products[:, :, start:stop])
    total = rows.sum(axis=1)
    if not gradient:
        return _PairSums(total, np.empty((count, 0)), np.empty((count, 0, 0)))
    # Half of what is above a strip's diagonal block belongs to its mirror image.
    rows += products[:, size]
    rows *= 0.5
    moment = products[:, :size] @ np.swapaxes(displacements.z[:, :size], 1, 2)
    return _PairSums(total, rows, moment)


def _exponent_factors(
    inverse_squares: Array,
    displacements: Displacements,
    precision: Array,
    forms: Array,
    offsets: Array,
) -> tuple[Array, Array, bool]:
    """Return [GZ'; e; 1] and [Z'; 1; e], whose product is e_i + e_j + z_i'G z_j.

    The third value says whether an exponent may lie below the smallest; G >= 0 bounds them.
    """
    count, size = precision.shape[:2]
    z = displacements.z
    distances = displacements.scaled_distances(inverse_squares)
    exponents = -0.25 * (distances + forms)
    exponents += offsets[:, None]
    g = -0.5 * precision
    diagonals(g)[...] += 0.5 * inverse_squares
    shape = (count, size + 2, z.shape[2])
    left, right = scratch("left", shape), scratch("right", shape)
    np.matmul(g, z[:, :size], out=left[:, :size])
    left[:, size] = exponents
    left[:, size + 1] = 1.0
    right[:, : size + 1] = z
    right[:, size + 1] = exponents
    clip = bool(2.0 * offsets.min() - distances.max() < SMALLEST_EXPONENT)
    return left, right, clip
