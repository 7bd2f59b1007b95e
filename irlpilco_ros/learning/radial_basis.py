"""Sums of Gaussian bumps at a Gaussian input: exact moments, and their pullback.

f_a(x) = sum_i beta_ai exp(-(x - c_i)' L_a^-1 (x - c_i) / 2), a GP's mean without its variance
(thesis (4.7)); L_a is diagonal. Notation of the moments: B = S + L, z = c - m, t = B^-1 z.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gaussian import Array, Gaussian, Moments, symmetric


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
    first = _first_moments(bumps, state)
    second = _second_moments(bumps, state)
    covariance = second.products - np.outer(first.mean, first.mean)

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array, Bumps]:
        bar = symmetric(covariance_bar)
        z_bar, S_bar, heights_bar, squares_bar = first.pull(
            mean_bar - 2.0 * bar @ first.mean, jacobian_bar
        )
        more = second.pull(bar)
        z_bar, S_bar = z_bar + more[0], S_bar + more[1]
        log_widths_bar = 2.0 * np.exp(2.0 * bumps.log_widths) * (squares_bar + more[3])
        return -z_bar.sum(axis=0), S_bar, Bumps(z_bar, heights_bar + more[2], log_widths_bar)

    return Moments(first.mean, covariance, first.jacobian), pullback


Pulled = tuple[Array, Array, Array, Array]
"""Derivatives by z (N, D), S (D, D), heights (F, N) and squared widths L (F, D)."""


@dataclass(frozen=True)
class _First:
    mean: Array
    jacobian: Array
    pull: Callable[[Array, Array], Pulled]


def _first_moments(bumps: Bumps, state: Gaussian) -> _First:
    """E f_a = sum_i q_i and E df_a/dx = sum_i q_i t_i."""
    z = bumps.centres - state.mean
    squares = np.exp(2.0 * bumps.log_widths)
    inverse = np.linalg.inv(state.covariance + squares[:, :, None] * np.eye(z.shape[1]))
    t = z @ inverse
    log_scale = 0.5 * (np.log(squares).sum(axis=1) + np.linalg.slogdet(inverse)[1])
    values = np.exp(log_scale[:, None] - 0.5 * np.sum(z * t, axis=2))
    q = bumps.heights * values
    jacobian = np.einsum("an,and->ad", q, t)

    def pull(mean_bar: Array, jacobian_bar: Array) -> Pulled:
        g = mean_bar[:, None] + np.einsum("and,ad->an", t, jacobian_bar)
        h = q * g
        back = np.einsum("ade,ae->ad", inverse, jacobian_bar)
        z_bar = np.einsum("an,ad->nd", q, back) - np.einsum("an,and->nd", h, t)
        B_bar = 0.5 * np.einsum("an,and,ane->ade", h, t, t)
        B_bar -= 0.5 * h.sum(axis=1)[:, None, None] * inverse
        B_bar -= symmetric(back[:, :, None] * jacobian[:, None, :])
        squares_bar = np.diagonal(B_bar, axis1=1, axis2=2)
        squares_bar = squares_bar + 0.5 * h.sum(axis=1)[:, None] / squares
        return z_bar, B_bar.sum(axis=0), g * values, squares_bar

    return _First(q.sum(axis=1), jacobian, pull)


@dataclass(frozen=True)
class _Second:
    products: Array
    pull: Callable[[Array], Pulled]


def _second_moments(bumps: Bumps, state: Gaussian) -> _Second:
    """E f_a f_b = sum_ij Q_ij of all pairs a <= b at once.

    With D = 1/L_a + 1/L_b, R = S D + I, T = R^-1 S, u_i = z_i / L_a and w_j = z_j / L_b:
    log Q_ij = log(beta_ai beta_bj) - log|R|/2 - (z_i'u_i + z_j'w_j)/2 + y'T y/2, y = u_i + w_j.
    """
    F, dimension = bumps.log_widths.shape
    a, b = np.triu_indices(F)
    S, z = state.covariance, bumps.centres - state.mean
    tight = np.exp(-2.0 * bumps.log_widths)
    ia, ib = tight[a][:, None, :], tight[b][:, None, :]
    both = (ia + ib)[:, 0]
    R = S * both[:, None, :] + np.eye(dimension)
    inverse = np.linalg.inv(R)
    T = symmetric(inverse @ S)
    u, w = z * ia, z * ib
    Tu, Tw = u @ T, w @ T
    own_u, own_w = 0.5 * np.sum(u * (Tu - z), axis=2), 0.5 * np.sum(w * (Tw - z), axis=2)
    exponent = own_u[:, :, None] + own_w[:, None, :] + u @ np.swapaxes(Tw, 1, 2)
    values = np.exp(exponent - 0.5 * np.linalg.slogdet(R)[1][:, None, None])
    heights_a, heights_b = bumps.heights[a], bumps.heights[b]
    Q = values * heights_a[:, :, None] * heights_b[:, None, :]
    products = np.zeros((F, F))
    products[a, b] = products[b, a] = Q.sum(axis=(1, 2))

    def pull(products_bar: Array) -> Pulled:
        price = products_bar[a, b] * np.where(a == b, 1.0, 2.0)
        pQ, pvalues = price[:, None, None] * Q, price[:, None, None] * values
        r, s = pQ.sum(axis=2)[:, :, None], pQ.sum(axis=1)[:, :, None]
        total = pQ.sum(axis=(1, 2))
        Qw, Qu = pQ @ w, np.swapaxes(pQ, 1, 2) @ u
        u_bar, w_bar = (r * u + Qw) @ T, (s * w + Qu) @ T
        z_bar = u_bar * ia + w_bar * ib - r * u - s * w
        cross = np.swapaxes(u, 1, 2) @ Qw
        Y = np.swapaxes(u, 1, 2) @ (r * u) + np.swapaxes(w, 1, 2) @ (s * w)
        Y += cross + np.swapaxes(cross, 1, 2)
        S_bar = 0.5 * np.swapaxes(inverse, 1, 2) @ Y @ inverse
        S_bar -= 0.5 * symmetric((total[:, None] * both)[:, :, None] * inverse)
        both_bar = -0.5 * np.einsum("pij,pjk,pki->pi", T, Y, T)
        both_bar -= 0.5 * total[:, None] * np.diagonal(T, axis1=1, axis2=2)
        ia_bar = both_bar + np.sum(z * u_bar - 0.5 * r * z * z, axis=1)
        ib_bar = both_bar + np.sum(z * w_bar - 0.5 * s * z * z, axis=1)
        heights_bar, tight_bar = np.zeros_like(bumps.heights), np.zeros_like(tight)
        np.add.at(heights_bar, a, np.einsum("pij,pj->pi", pvalues, heights_b))
        np.add.at(heights_bar, b, np.einsum("pij,pi->pj", pvalues, heights_a))
        np.add.at(tight_bar, a, ia_bar)
        np.add.at(tight_bar, b, ib_bar)
        return z_bar.sum(axis=0), S_bar.sum(axis=0), heights_bar, -(tight**2) * tight_bar

    return _Second(products, pull)


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
