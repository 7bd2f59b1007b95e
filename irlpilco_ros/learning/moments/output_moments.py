"""Mean and variance of each GP output at a Gaussian input, with their derivatives.

The formulas are those of moment matching (2.34-2.45, Deisenroth & Rasmussen 2011), written with
z_i = x_i - m, Lambda = diag(l^2), P1 = (Lambda + S)^-1 and P2 = (Lambda + 2S)^-1:

    q_i = beta_i s^2 |I + S/Lambda|^-1/2 exp(-1/2 z_i'P1 z_i)
    M = sum q                    V = E[df/dx] = P1 sum q_i z_i
    dM/dm = V                    dM/dS = Hess / 2                    dV/dm = Hess
                                 with Hess = E[d2f/dx2] = P1 (sum q_i z_i z_i') P1 - M P1

    G = (Lambda^-1 - P2) / 2     e_i = log s^2 - 1/4 log|I + 2S/Lambda|
                                       - 1/2 z_i'Lambda^-1 z_i + 1/2 z_i'G z_i
    Q_ij = (beta_i beta_j - K^-1_ij) exp(e_i + e_j + z_i'G z_j)      r = Q1
    v = sum Q + s^2 - M^2
    d(sum Q)/dm = 2 P2 Z'r       d(sum Q)/dS = P2 Z'(diag(r) + Q)Z P2 - (sum Q) P2

So a variance with all its derivatives takes one n x n exponential and two n x n x P products,
and nothing of size n x n is kept; no Hess is ever formed, since the pullback only needs its
product with one vector. Q is symmetric: only the part of it on and above its diagonal blocks is
computed, strip by strip.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gp.posterior import Posterior
from irlpilco_ros.learning.moments.displacements import Displacements
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import diagonals, regularised_inverse
from irlpilco_ros.learning.numerics.threads import Task, one_blas_thread, run_later, scratch

_CACHED_ELEMENTS = 450_000  # n x n values whose strips stay in the cache together

SMALLEST_EXPONENT = -500.0
"""Exponents are clipped here: exp(-500) is nothing, but denormal numbers are 20 times slower."""


@dataclass(frozen=True)
class OutputMoments:
    """Means and variances of b outputs, and what their pullback needs.

    Attributes:
        displacements: Of the supporting points from the input's mean.
        mean: M, of shape (b,).
        variance: v, of shape (b,).
        jacobian: V, of shape (b, P).
        precision: P1, of shape (b, P, P).
        shares: q, of shape (b, n).
        square_derivatives: Those of sum Q; None without gradient.
    """

    displacements: Displacements
    mean: Array
    variance: Array
    jacobian: Array
    precision: Array
    shares: Array
    square_derivatives: Task[SquareDerivatives] | None

    def pullback(
        self, mean_bar: Array, jacobian_bar: Array, variance_bar: Array
    ) -> tuple[Array, Array]:
        """Pull derivatives by M (b,), V (b, P), v (b,) back to m (P,) and S (P, P), summed over b.

        With t_i = P1 z_i and g_i = M_bar - 2 M v_bar + t_i'V_bar, M and V give
        m_bar = sum q_i g_i t_i - M P1 V_bar and, by the third expected derivative of f,
        S_bar = 1/2 sum q_i g_i t_i t_i' - 1/2 (sum q_i g_i) P1 - P1 V_bar V',
        of which the symmetric part counts.
        """
        assert self.square_derivatives is not None
        sides = np.matmul(self.precision, jacobian_bar[:, :, None])[:, :, 0]
        along = self.displacements.linear_forms(sides)
        along += (mean_bar - 2.0 * variance_bar * self.mean)[:, None]
        along *= self.shares
        flat = self.precision.reshape(-1, sides.shape[1])
        m_bar = self.displacements.first_moments(along).ravel() @ flat - self.mean @ sides
        moment = self.displacements.second_moments(along)
        s_bar = (self.precision @ (moment @ self.precision)).sum(axis=0)
        s_bar -= _weighted_sum(along.sum(axis=1), self.precision)
        s_bar *= 0.5
        s_bar -= sides.T @ self.jacobian
        squares_mean, squares_covariance = self.square_derivatives.result().pullback(variance_bar)
        return m_bar + squares_mean, s_bar + squares_covariance


@dataclass(frozen=True)
class SquareDerivatives:
    """Derivatives of sum Q, what the mean square of each of b outputs is short of s^2.

    Attributes:
        by_mean: Of shape (b, P).
        by_covariance: Of shape (b, P, P).
    """

    by_mean: Array
    by_covariance: Array

    def pullback(self, total_bar: Array) -> tuple[Array, Array]:
        """Pull derivatives by the totals (b,) back to m (P,) and S (P, P), summed over b."""
        return total_bar @ self.by_mean, _weighted_sum(total_bar, self.by_covariance)


def _weighted_sum(weights: Array, stack: Array) -> Array:
    """Return sum_b w_b X_b, for weights (b,) and a stack (b, P, P)."""
    total: Array = (weights @ stack.reshape(len(weights), -1)).reshape(stack.shape[1:])
    return total


def output_moments(
    posterior: Posterior,
    group: slice,
    all_displacements: Task[Displacements],
    covariance: Array,
    gradient: bool,
    threads: int,
) -> OutputMoments:
    """Return means and variances of a group of outputs for an input N(m, covariance).

    Args:
        posterior: Of all outputs.
        group: Which outputs.
        all_displacements: Of the supporting points from m: one of the threads makes them while
            others begin with the inverses.
        covariance: S, of shape (P, P).
        gradient: False saves the work for the pullback.
        threads: With more than one, derivatives are left to helpers, who find the time for them
            while others do what must be done in sequence.

    Raises:
        NumericalError: if the covariance is indefinite.
    """
    all_displacements.run()
    squares = posterior.lengthscales_squared[group]
    count = len(squares)
    precisions, log_determinants = regularised_inverse(
        covariance, np.concatenate([squares, 0.5 * squares])
    )
    precisions[count:] *= 0.5
    precision = precisions[:count]
    displacements = all_displacements.result().select(group)
    forms = displacements.quadratic_forms(precision)
    log_signal = np.log(posterior.signal_variance[group])

    exponents = -0.5 * forms
    exponents += (log_signal - 0.5 * log_determinants[:count])[:, None]
    np.maximum(exponents, SMALLEST_EXPONENT, out=exponents)
    shares = posterior.weights[group] * np.exp(exponents)
    mean = shares.sum(axis=1)
    jacobian = (precision @ displacements.first_moments(shares)[:, :, None])[:, :, 0]

    offsets = log_signal - 0.25 * log_determinants[count:]
    squares_of = _PairSums.of(
        posterior, group, displacements, precisions[count:], offsets, gradient
    )
    variance = squares_of.total + posterior.signal_variance[group] - mean**2
    derivatives = run_later(squares_of.derivatives, threads) if gradient else None
    return OutputMoments(displacements, mean, variance, jacobian, precision, shares, derivatives)


@dataclass(frozen=True)
class _PairSums:
    """Sums over Q, which itself is not kept.

    Attributes:
        displacements: Of the supporting points from the input's mean.
        precision: P2, of shape (b, P, P).
        total: sum Q, of shape (b,).
        rows: The computed part of Q times 1, of shape (b, n).
        products: [Z'; 1'] times the computed part of Q, of shape (b, P + 1, n); empty without
            gradient.
    """

    displacements: Displacements
    precision: Array
    total: Array
    rows: Array
    products: Array

    @staticmethod
    def of(
        posterior: Posterior,
        group: slice,
        displacements: Displacements,
        precision: Array,
        offsets: Array,
        gradient: bool,
    ) -> _PairSums:
        """Return the sums, given P2 and log s^2 - 1/4 log|I + 2S/Lambda|."""
        left, right, clip = _exponent_factors(
            1.0 / posterior.lengthscales_squared[group], displacements, precision, offsets
        )
        count, size = precision.shape[:2]
        n = left.shape[2]
        rows = np.zeros((count, n))
        products = np.empty((count, size + 1, n if gradient else 0))
        strips = zip(posterior.strips, posterior.pair_weights, strict=True)
        for part, ((start, stop), weights) in itertools.product(cached_parts(count, n), strips):
            # The strip's columns, and all rows down to its last column's.
            turned = np.swapaxes(left[part, :, :stop], 1, 2)
            pairs = scratch("pairs", (len(turned), stop, stop - start))
            np.matmul(turned, right[part, :, start:stop], out=pairs)
            if clip:
                np.maximum(pairs, SMALLEST_EXPONENT, out=pairs)
            np.exp(pairs, out=pairs)
            pairs *= weights[group][part]
            rows[part, :stop] += pairs @ np.ones(stop - start)
            if gradient:
                z = displacements.select(part).z[:, :, :stop]
                np.matmul(z, pairs, out=products[part, :, start:stop])
        return _PairSums(displacements, precision, rows.sum(axis=1), rows, products)

    def derivatives(self) -> SquareDerivatives:
        """Return the derivatives of the total."""
        size = self.precision.shape[1]
        with one_blas_thread():
            # Half of what is above a strip's diagonal block belongs to its mirror image.
            rows = 0.5 * (self.rows + self.products[:, size])
            products = self.products[:, :size]
            weighted = scratch("weighted", products.shape)
            np.multiply(self.displacements.z[:, :size], rows[:, None], out=weighted)
            weighted += products
            moment = weighted @ self.displacements.rows
            by_covariance = self.precision @ (moment @ self.precision)
            by_covariance -= self.total[:, None, None] * self.precision
            by_mean = self.precision @ self.displacements.first_moments(rows)[:, :, None]
        return SquareDerivatives(2.0 * by_mean[:, :, 0], by_covariance)


def cached_parts(count: int, n: int) -> list[slice]:
    """Cut a stack of n x n matrices into parts that fit into the cache, a strip at a time."""
    step = max(1, _CACHED_ELEMENTS // n**2)
    return [slice(start, min(start + step, count)) for start in range(0, count, step)]


def _exponent_factors(
    inverse_squares: Array, displacements: Displacements, precision: Array, offsets: Array
) -> tuple[Array, Array, bool]:
    """Return [GZ'; e; 1] and [Z'; 1; e], whose product is e_i + e_j + z_i'G z_j.

    The third value says whether an exponent may lie below the smallest; G >= 0 bounds them.
    """
    count, size = precision.shape[:2]
    z = displacements.z
    g = -0.5 * precision
    diagonals(g)[...] += 0.5 * inverse_squares
    shape = (count, size + 2, z.shape[2])
    left, right = scratch("left", shape), scratch("right", shape)
    turned = np.matmul(g, z[:, :size], out=left[:, :size])
    forms = np.multiply(turned, z[:, :size], out=right[:, :size]).sum(axis=1)  # z_i'G z_i
    distances = displacements.scaled_distances(inverse_squares)
    exponents = 0.5 * (forms - distances)
    exponents += offsets[:, None]
    left[:, size] = exponents
    left[:, size + 1] = 1.0
    right[:, : size + 1] = z
    right[:, size + 1] = exponents
    clip = bool(2.0 * offsets.min() - distances.max() < SMALLEST_EXPONENT)
    return left, right, clip
