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
from irlpilco_ros.learning.moments.pair_blocks import (
    cached_parts,
    clipped_exp,
    column_strips,
    lies_below,
    pair_weights,
)
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import diagonals, regularised_inverse
from irlpilco_ros.learning.numerics.threads import Deferred, one_blas_thread, run_later, scratch


@dataclass(frozen=True)
class OutputGroup:
    """A group of b outputs of a posterior, as their moments need them.

    Attributes:
        which: Which outputs.
        lengthscales_squared: Diagonal of Lambda, of shape (b, P).
        signal_variance: s^2, of shape (b,).
        weights: beta, of shape (b, n).
        pair_weights: beta beta' - K^-1 in strips, see `pair_blocks.pair_weights`.
    """

    which: slice
    lengthscales_squared: Array
    signal_variance: Array
    weights: Array
    pair_weights: tuple[Array, ...]

    @staticmethod
    def of(posterior: Posterior, which: slice) -> OutputGroup:
        """Prepare a group of outputs."""
        weights = posterior.weights[which]
        return OutputGroup(
            which,
            posterior.lengthscales_squared[which],
            posterior.signal_variance[which],
            weights,
            pair_weights(weights, posterior.inverse[which]),
        )


@dataclass(frozen=True)
class OutputMoments:
    """Means and variances of b outputs, and what their pullback needs.

    Attributes:
        displacements: Of the supporting points from the input's mean.
        mean: M, of shape (b,).
        variance: v, of shape (b,).
        jacobian: V, of shape (b, P).
        P1: Of shape (b, P, P).
        q: Of shape (b, n).
        square_derivatives: Those of sum Q; None without gradient.
    """

    displacements: Displacements
    mean: Array
    variance: Array
    jacobian: Array
    P1: Array
    q: Array
    square_derivatives: Deferred[SquareDerivatives] | None

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
        P1 = self.P1
        P1_V_bar = np.matmul(P1, jacobian_bar[:, :, None])[:, :, 0]
        qg = self.displacements.linear_forms(P1_V_bar)
        qg += (mean_bar - 2.0 * variance_bar * self.mean)[:, None]
        qg *= self.q
        P1_rows = P1.reshape(-1, P1.shape[2])
        m_bar = self.displacements.first_moments(qg).ravel() @ P1_rows - self.mean @ P1_V_bar
        S_bar = (P1 @ (self.displacements.second_moments(qg) @ P1)).sum(axis=0)
        S_bar -= _weighted_sum(qg.sum(axis=1), P1)
        S_bar *= 0.5
        S_bar -= P1_V_bar.T @ self.jacobian
        squares_m_bar, squares_S_bar = self.square_derivatives.result().pullback(variance_bar)
        return m_bar + squares_m_bar, S_bar + squares_S_bar


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
    group: OutputGroup,
    all_displacements: Deferred[Displacements],
    covariance: Array,
    gradient: bool,
    threads: int,
) -> OutputMoments:
    """Return means and variances of a group of outputs for an input N(m, covariance).

    Args:
        group: The outputs.
        all_displacements: Of the supporting points from m: one of the threads makes them while
            others begin with the inverses.
        covariance: S, of shape (P, P).
        gradient: False saves the work for the pullback.
        threads: With more than one, derivatives are left to helpers, who find the time for them
            while others do what must be done in sequence.

    Raises:
        NumericalError: if the covariance is indefinite.
    """
    all_displacements.begin()
    squares = group.lengthscales_squared
    count = len(squares)
    inverses, log_determinants = regularised_inverse(
        covariance, np.concatenate([squares, 0.5 * squares])
    )
    P1, P2 = inverses[:count].copy(), inverses[count:]  # a copy outlives the rest
    P2 *= 0.5
    displacements = all_displacements.result().select(group.which)
    log_signal = np.log(group.signal_variance)

    exponents = -0.5 * displacements.quadratic_forms(P1)
    exponents += (log_signal - 0.5 * log_determinants[:count])[:, None]
    q = group.weights * clipped_exp(exponents)
    mean = q.sum(axis=1)
    jacobian = (P1 @ displacements.first_moments(q)[:, :, None])[:, :, 0]

    offsets = log_signal - 0.25 * log_determinants[count:]
    sums = _PairSums.of(group, displacements, P2, offsets, gradient)
    variance = sums.total + group.signal_variance - mean**2
    derivatives = run_later(sums.derivatives, threads) if gradient else None
    return OutputMoments(displacements, mean, variance, jacobian, P1, q, derivatives)


@dataclass(frozen=True)
class _PairSums:
    """Sums over Q, which itself is not kept.

    Attributes:
        displacements: Of the supporting points from the input's mean.
        P2: Of shape (b, P, P).
        total: sum Q, of shape (b,).
        rows: The computed part of Q times 1, of shape (b, n).
        products: [Z'; 1'] times the computed part of Q, of shape (b, P + 1, n); empty without
            gradient.
    """

    displacements: Displacements
    P2: Array
    total: Array
    rows: Array
    products: Array

    @staticmethod
    def of(
        group: OutputGroup, displacements: Displacements, P2: Array, offsets: Array, gradient: bool
    ) -> _PairSums:
        """Return the sums, given P2 and log s^2 - 1/4 log|I + 2S/Lambda|."""
        left, right, clip = _exponent_factors(
            1.0 / group.lengthscales_squared, displacements, P2, offsets
        )
        count, size = P2.shape[:2]
        n = left.shape[2]
        rows = np.zeros((count, n))
        products = np.empty((count, size + 1, n if gradient else 0))
        strips = zip(column_strips(n), group.pair_weights, strict=True)
        for part, (columns, weights) in itertools.product(cached_parts(count, n), strips):
            # The strip's columns, and all rows down to its last column's.
            stop, width = columns.stop, columns.stop - columns.start
            left_rows = np.swapaxes(left[part, :, :stop], 1, 2)
            Q = scratch("pairs", (len(left_rows), stop, width))
            np.matmul(left_rows, right[part, :, columns], out=Q)
            clipped_exp(Q, clip)
            Q *= weights[part]
            rows[part, :stop] += Q @ np.ones(width)
            if gradient:
                z = displacements.select(part).z[:, :, :stop]
                np.matmul(z, Q, out=products[part, :, columns])
        return _PairSums(displacements, P2, rows.sum(axis=1), rows, products)

    def derivatives(self) -> SquareDerivatives:
        """Return the derivatives of the total."""
        size = self.P2.shape[1]
        with one_blas_thread():
            # Half of what is above a strip's diagonal block belongs to its mirror image.
            r = 0.5 * (self.rows + self.products[:, size])
            products = self.products[:, :size]
            weighted = scratch("weighted", products.shape)
            np.multiply(self.displacements.z[:, :size], r[:, None], out=weighted)
            weighted += products
            moment = weighted @ self.displacements.rows
            by_covariance = self.P2 @ (moment @ self.P2)
            by_covariance -= self.total[:, None, None] * self.P2
            by_mean = self.P2 @ self.displacements.first_moments(r)[:, :, None]
        return SquareDerivatives(2.0 * by_mean[:, :, 0], by_covariance)


def _exponent_factors(
    inverse_squares: Array, displacements: Displacements, P2: Array, offsets: Array
) -> tuple[Array, Array, bool]:
    """Return [GZ'; e; 1] and [Z'; 1; e], whose product is e_i + e_j + z_i'G z_j.

    The third value says whether an exponent may have to be clipped; G >= 0 bounds them.
    """
    count, size = P2.shape[:2]
    z = displacements.z
    G = -0.5 * P2
    diagonals(G)[...] += 0.5 * inverse_squares
    shape = (count, size + 2, z.shape[2])
    left, right = scratch("left", shape), scratch("right", shape)
    Gz = np.matmul(G, z[:, :size], out=left[:, :size])
    zGz = np.multiply(Gz, z[:, :size], out=right[:, :size]).sum(axis=1)
    distances = displacements.scaled_distances(inverse_squares)
    e = 0.5 * (zGz - distances)
    e += offsets[:, None]
    left[:, size] = e
    left[:, size + 1] = 1.0
    right[:, : size + 1] = z
    right[:, size + 1] = e
    return left, right, lies_below(2.0 * offsets.min() - distances.max())
