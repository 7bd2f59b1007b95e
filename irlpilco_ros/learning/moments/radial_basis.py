"""Sums of Gaussian bumps at a Gaussian input: exact moments, and their pullback.

f_a(x) = sum_i beta_ai exp(-(x - c_i)' L_a^-1 (x - c_i) / 2), a GP's mean without its variance
(thesis (4.7)); L_a is diagonal. Notation of the moments: B = S + L, z = c - m, t = B^-1 z.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.numerics.linear_algebra import diagonals, regularised_inverse


@dataclass(frozen=True)
class Bumps:
    """A sum of N Gaussian bumps for each of F outputs.

    Attributes:
        centres: c, shape (N, D), shared by all outputs.
        heights: beta, shape (F, N).
        log_widths: Logarithm of the square roots of L, shape (F, D).
    """

    centres: Array
    heights: Array
    log_widths: Array


BumpsPullback = Callable[[Array, Array, Array], tuple[Array, Array, Bumps]]
"""(mean_bar (F,), covariance_bar (F, F), jacobian_bar (F, D)) ->
(input mean_bar, input covariance_bar, derivatives by centres, heights and log widths)."""


FitPullback = Callable[[Bumps], tuple[Array, Array, Array]]
"""Derivatives by the bumps -> those by centres (N, D), targets (N, F), log widths (F, D)."""


def bumps_moments(bumps: Bumps, state: Gaussian) -> tuple[Moments, BumpsPullback]:
    """Return the exact moments of a sum of bumps at a Gaussian input, and their pullback."""
    count = len(bumps.heights)
    inv_L = np.exp(-2.0 * bumps.log_widths)
    a, b = _pairs(count)
    regularisers = np.concatenate([1.0 / inv_L, 1.0 / (inv_L[a] + inv_L[b])])
    inverses, log_determinants = regularised_inverse(state.covariance, regularisers)
    z = bumps.centres - state.mean
    first = _First.of(bumps.heights, z, inverses[:count], log_determinants[:count])
    pairs = _Pairs(a, b, z, inv_L[a], inv_L[b], bumps.heights[a], bumps.heights[b])
    second = _Second.of(pairs, inverses[count:], log_determinants[count:])
    products = np.empty((count, count))
    products[a, b] = products[b, a] = second.totals

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array, Bumps]:
        bar = symmetric(covariance_bar)
        z_bar, S_bar, heights_bar, squares_bar = first.pull(
            mean_bar - 2.0 * bar @ first.mean, jacobian_bar, inv_L
        )
        totals_bar = bar[a, b] * np.where(a == b, 1.0, 2.0)
        more = second.pull(totals_bar, count)
        log_widths_bar = 2.0 * (squares_bar / inv_L - inv_L * more[3])
        return (
            -(z_bar + more[0]).sum(axis=0),
            S_bar + more[1],
            Bumps(z_bar + more[0], heights_bar + more[2], log_widths_bar),
        )

    covariance = products - np.outer(first.mean, first.mean)
    return Moments(first.mean, covariance, first.jacobian), pullback


@lru_cache(maxsize=16)
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of all pairs a <= b."""
    a, b = np.triu_indices(count)
    return a, b


Pulled = tuple[Array, Array, Array, Array]
"""Derivatives by z (N, D), S (D, D), heights (F, N) and by L or 1 / L (F, D)."""


@dataclass(frozen=True)
class _First:
    """E f_a = sum_i q_i and E df_a/dx = sum_i q_i t_i.

    Attributes:
        mean: E f, shape (F,).
        jacobian: E df/dx, shape (F, D).
        inverse: B^-1, shape (F, D, D).
        values: q for heights of 1, shape (F, N).
        q: Shape (F, N).
        t: Shape (F, N, D).
    """

    mean: Array
    jacobian: Array
    inverse: Array
    values: Array
    q: Array
    t: Array

    @staticmethod
    def of(heights: Array, z: Array, inverse: Array, log_determinant: Array) -> _First:
        """Return the first moments, given B^-1 and log|I + S/L|."""
        t = z @ inverse
        values = np.exp(-0.5 * ((z * t).sum(axis=2) + log_determinant[:, None]))
        q = heights * values
        jacobian = (q[:, None] @ t)[:, 0]
        return _First(q.sum(axis=1), jacobian, inverse, values, q, t)

    def pull(self, mean_bar: Array, jacobian_bar: Array, inv_L: Array) -> Pulled:
        """Pull derivatives by mean and Jacobian back, with 1 / L given; the last is by L."""
        g = mean_bar[:, None] + (self.t @ jacobian_bar[:, :, None])[:, :, 0]
        h = self.q * g
        total = h.sum(axis=1)[:, None]
        back = (jacobian_bar[:, None] @ self.inverse)[:, 0]
        z_bar = self.q.T @ back - (h[:, :, None] * self.t).sum(axis=0)
        B_bar = 0.5 * (self.t * h[:, :, None]).swapaxes(1, 2) @ self.t
        B_bar -= 0.5 * total[:, :, None] * self.inverse
        B_bar -= symmetric(back[:, :, None] * self.jacobian[:, None, :])
        squares_bar = B_bar.diagonal(axis1=1, axis2=2) + 0.5 * total * inv_L
        return z_bar, B_bar.sum(axis=0), g * self.values, squares_bar


@dataclass(frozen=True)
class _Pairs:
    """All p pairs a <= b of outputs.

    Attributes:
        a: Indices of the first, shape (p,).
        b: Indices of the second, shape (p,).
        z: Shape (N, D).
        D_a: 1 / L_a, shape (p, D).
        D_b: 1 / L_b, shape (p, D).
        heights_a: Shape (p, N).
        heights_b: Shape (p, N).
    """

    a: NDArray[np.intp]
    b: NDArray[np.intp]
    z: Array
    D_a: Array
    D_b: Array
    heights_a: Array
    heights_b: Array


@dataclass(frozen=True)
class _Second:
    """E f_a f_b = sum_ij Q_ij of all pairs a <= b at once.

    With D = 1/L_a + 1/L_b, K = (S + D^-1)^-1, T = D^-1 - D^-1 K D^-1 (which is (S^-1 + D)^-1),
    u_i = z_i / L_a and w_j = z_j / L_b:
    log Q_ij = log(beta_ai beta_bj) - log|I + S D|/2 - (z_i'u_i + z_j'w_j)/2 + y'T y/2
    with y = u_i + w_j.

    Attributes:
        pairs: The pairs.
        totals: sum_ij Q_ij, shape (p,).
        K: Shape (p, D, D).
        T: Shape (p, D, D).
        values: Q for heights of 1, shape (p, N, N).
    """

    pairs: _Pairs
    totals: Array
    K: Array
    T: Array
    values: Array

    @staticmethod
    def of(pairs: _Pairs, K: Array, log_determinant: Array) -> _Second:
        """Return the second moments, given K and log|I + S D|."""
        inv_D = 1.0 / (pairs.D_a + pairs.D_b)
        T = -inv_D[:, :, None] * K * inv_D[:, None, :]
        diagonals(T)[...] += inv_D
        z = pairs.z
        u, w = z * pairs.D_a[:, None], z * pairs.D_b[:, None]
        Tu, Tw = u @ T, w @ T
        own_u = 0.5 * ((u * (Tu - z)).sum(axis=2) - log_determinant[:, None])
        own_w = 0.5 * (w * (Tw - z)).sum(axis=2)
        values = np.exp(own_u[:, :, None] + own_w[:, None, :] + u @ Tw.swapaxes(1, 2))
        weighed = (values @ pairs.heights_b[:, :, None])[:, :, 0]
        return _Second(pairs, (pairs.heights_a * weighed).sum(axis=1), K, T, values)

    def pull(self, totals_bar: Array, outputs: int) -> Pulled:
        """Pull derivatives by the totals (p,) back; the last is by 1 / L."""
        pairs, T = self.pairs, self.T
        D_a, D_b, z = pairs.D_a[:, None], pairs.D_b[:, None], pairs.z
        values = totals_bar[:, None, None] * self.values
        by_a = values @ pairs.heights_b[:, :, None]
        by_b = values.swapaxes(1, 2) @ pairs.heights_a[:, :, None]
        r, s = pairs.heights_a[:, :, None] * by_a, pairs.heights_b[:, :, None] * by_b
        Q = pairs.heights_a[:, :, None] * values * pairs.heights_b[:, None, :]
        u, w = z * D_a, z * D_b
        ru, sw, Qw = r * u, s * w, Q @ w
        u_bar, w_bar = (ru + Qw) @ T, (sw + Q.swapaxes(1, 2) @ u) @ T
        z_bar = u_bar * D_a + w_bar * D_b - ru - sw
        half = 0.5 * u.swapaxes(1, 2) @ ru + u.swapaxes(1, 2) @ Qw + 0.5 * w.swapaxes(1, 2) @ sw
        S_bar, D_bar = self._pull_spread(half + half.swapaxes(1, 2), r.sum(axis=1))
        heights_bar, inv_L_bar = np.zeros((outputs, len(z))), np.zeros((outputs, z.shape[1]))
        np.add.at(heights_bar, pairs.a, by_a[:, :, 0])
        np.add.at(heights_bar, pairs.b, by_b[:, :, 0])
        np.add.at(inv_L_bar, pairs.a, D_bar + (z * (u_bar - 0.5 * r * z)).sum(axis=1))
        np.add.at(inv_L_bar, pairs.b, D_bar + (z * (w_bar - 0.5 * s * z)).sum(axis=1))
        return z_bar.sum(axis=0), S_bar, heights_bar, inv_L_bar

    def _pull_spread(self, Y: Array, total: Array) -> tuple[Array, Array]:
        """Return the derivatives by S (D, D) and by D (p, D) for fixed u and w.

        Args:
            Y: sum_ij Q_ij y y', shape (p, D, D).
            total: sum_ij Q_ij, shape (p, 1).
        """
        inv_D = 1.0 / (self.pairs.D_a + self.pairs.D_b)
        K_inv_D = self.K * inv_D[:, None, :]
        S_bar = 0.5 * (K_inv_D @ Y @ K_inv_D.swapaxes(1, 2) - total[:, :, None] * self.K)
        D_bar = -0.5 * ((self.T @ Y) * self.T).sum(axis=2)
        D_bar -= 0.5 * total * diagonals(self.T)
        return S_bar.sum(axis=0), D_bar


def fit_bumps(
    centres: Array, targets: Array, log_widths: Array, ridge: float
) -> tuple[Bumps, FitPullback]:
    """Return bumps through targets at their centres: beta_a = (k(c, c) + ridge I)^-1 y_a.

    Args:
        centres: c, shape (N, D).
        targets: y, shape (N, F).
        log_widths: Shape (F, D).
        ridge: Keeps the system well conditioned: how far targets may be missed.

    Returns:
        The bumps, and the pullback from derivatives by the bumps to those by centres (N, D),
        targets (N, F) and log widths (F, D).
    """
    scaled = centres[None] * np.exp(-log_widths)[:, None, :]
    differences = scaled[:, :, None, :] - scaled[:, None, :, :]
    kernel = np.exp(-0.5 * np.sum(differences**2, axis=3))
    inverse = np.linalg.inv(kernel + ridge * np.eye(len(centres)))
    heights = np.einsum("aij,ja->ai", inverse, targets)

    def pullback(bar: Bumps) -> tuple[Array, Array, Array]:
        targets_bar = np.einsum("aij,ai->ja", inverse, bar.heights)
        weighed = -symmetric(targets_bar.T[:, :, None] * heights[:, None, :]) * kernel
        pulled = np.einsum("aij,aijd->aid", weighed, differences)
        centres_bar = bar.centres - 2.0 * np.sum(pulled * np.exp(-log_widths)[:, None, :], axis=0)
        widths_bar = bar.log_widths + np.einsum("aij,aijd->ad", weighed, differences**2)
        return centres_bar, targets_bar, widths_bar

    return Bumps(centres, heights, log_widths), pullback
