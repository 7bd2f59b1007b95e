"""Exact mean products of two different GP outputs a, b at a Gaussian input.

With D = Lambda^-1 of each output, L = D_a + D_b, K = (S + L^-1)^-1 and T = L^-1 - L^-1 K L^-1
(which is (S^-1 + L)^-1, also for a singular S):

    e_ai = log s_a^2 - 1/4 log|I + S L| - 1/2 z_i'D_a z_i + 1/2 z_i'D_a T D_a z_i
    Q_ij = beta_ai beta_bj exp(e_ai + e_bj + z_i'D_a T D_b z_j)      r = Q1      c = Q'1
    E[f_a f_b] = sum Q
    d/dm = K L^-1 (D_a Z'r + D_b Z'c)
    d/dS = 1/2 K L^-1 [sum_ij Q_ij z_ij z_ij'] L^-1 K - 1/2 (sum Q) K
                                                                with z_ij = D_a z_i + D_b z_j
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.gp.posterior import Posterior
from irlpilco_ros.learning.moments.displacements import Displacements, pack, unpack
from irlpilco_ros.learning.moments.pair_blocks import (
    cached_parts,
    clipped_exp,
    column_strips,
    lies_below,
)
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import diagonals, regularised_inverse
from irlpilco_ros.learning.numerics.sharing import even_slices
from irlpilco_ros.learning.numerics.threads import run_parallel, scratch

_BLOCK_ELEMENTS = 2_000_000  # most n x n values of the pairs that are worked on together


@dataclass(frozen=True)
class PairMoments:
    """Mean products of all pairs of outputs, and their derivatives.

    Attributes:
        products: E[f_a f_b], of shape (E, E), symmetric, with a zero diagonal.
        first: Index a of each pair, of shape (p,).
        second: Index b of each pair, of shape (p,).
        by_mean: Derivative by m of each pair's, of shape (p, P); empty without gradient.
        by_covariance: Derivative by S of each pair's, of shape (p, P, P), of which the symmetric
            part counts; empty likewise.
    """

    products: Array
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    by_mean: Array
    by_covariance: Array

    def pullback(self, products_bar: Array) -> tuple[Array, Array]:
        """Pull a symmetric derivative by the products back to m (P,) and S (P, P).

        Of the latter the symmetric part counts.
        """
        bars = 2.0 * products_bar[self.first, self.second]
        return bars @ self.by_mean, np.tensordot(bars, self.by_covariance, axes=1)


@dataclass(frozen=True)
class _Block:
    """What a block of pairs is made of.

    Attributes:
        a: Index of the first output, of shape (b,).
        b: Index of the second.
        D_a: Diagonal of D_a, of shape (b, P).
        D_b: Diagonal of D_b.
        DD_a: What packed matrices M are multiplied by for D_a M D_a, of shape (b, P (P + 1) / 2).
        DD_b: The same for D_b.
        z_a: Displacements of the points that support a.
        z_b: Those that support b.
    """

    a: NDArray[np.intp]
    b: NDArray[np.intp]
    D_a: Array
    D_b: Array
    DD_a: Array
    DD_b: Array
    z_a: Displacements
    z_b: Displacements


def all_pairs(
    posterior: Posterior,
    displacements: Displacements,
    covariance: Array,
    gradient: bool,
    sharers: int,
    threads: int,
) -> PairMoments:
    """Return the exact mean products of all pairs of outputs, with their derivatives if wanted.

    Args:
        posterior: Of E outputs.
        displacements: Of the supporting points from the input's mean.
        covariance: Covariance of the input, of shape (P, P).
        gradient: False leaves the derivatives empty.
        sharers: Among how many threads the work could be shared: each gets as many blocks.
        threads: How many threads may work.
    """
    first, second = np.triu_indices(posterior.outputs, k=1)
    D = 1.0 / posterior.lengthscales_squared
    DD = pack(D[:, :, None] * D[:, None, :])
    size = len(covariance) if gradient else 0
    values = np.zeros(len(first))
    by_mean = np.empty((len(first), size))
    by_covariance = np.empty((len(first), size, size))

    def one_block(part: slice) -> None:
        a, b = first[part], second[part]
        block = _Block(
            a, b, D[a], D[b], DD[a], DD[b], displacements.select(a), displacements.select(b)
        )
        values[part] = _mean_products(
            posterior, covariance, block, by_mean[part], by_covariance[part], gradient
        )

    elements = len(first) * posterior.weights.shape[1] ** 2
    blocks = sharers * max(1, math.ceil(elements / (sharers * _BLOCK_ELEMENTS)))
    run_parallel(one_block, even_slices(len(first), blocks), threads)
    result = np.zeros((posterior.outputs, posterior.outputs))
    result[first, second] = values
    result[second, first] = values
    return PairMoments(result, first, second, by_mean, by_covariance)


def _mean_products(
    posterior: Posterior,
    covariance: Array,
    block: _Block,
    by_mean: Array,
    by_covariance: Array,
    gradient: bool,
) -> Array:
    """Return the mean products of a block of pairs (b,), and fill in their derivatives."""
    inv_L = 1.0 / (block.D_a + block.D_b)
    K, log_determinant = regularised_inverse(covariance, inv_L)
    left, right, clip = _exponent_factors(posterior, block, inv_L, K, log_determinant)
    rows, products = _products(posterior, block, left, right, clip, gradient)
    total: Array = rows.sum(axis=1)
    if gradient:
        moment, first = _moments(block, rows, products)
        K_inv_L = K * inv_L[:, None, :]
        by_mean[...] = (K_inv_L @ first[:, :, None])[:, :, 0]
        # The second factor is the transpose of K_inv_L, K being symmetric, in BLAS's own order.
        np.matmul(K_inv_L @ moment, inv_L[:, :, None] * K, out=by_covariance)
        by_covariance -= total[:, None, None] * K
        by_covariance *= 0.5
    return total


def _products(
    posterior: Posterior,
    block: _Block,
    left: Array,
    right: Array,
    clip: bool,
    gradient: bool,
) -> tuple[Array, Array]:
    """Return r (b, n) and, with gradient, Z'Q with c in the last row (b, P + 1, n).

    Q is made and used for a few pairs at a time, and strip by strip of its columns, so that it
    stays in the cache.
    """
    weights_a, weights_b = posterior.weights[block.a], posterior.weights[block.b]
    count, height, n = left.shape
    rows = np.zeros((count, n))
    products = scratch("products", (count, height - 1, n))
    weighted = block.z_a.z * weights_a[:, None, :] if gradient else products
    for part, columns in itertools.product(cached_parts(count, n), column_strips(n)):
        left_rows = np.swapaxes(left[part], 1, 2)
        Q = scratch("pairs", (len(left_rows), n, columns.stop - columns.start))
        np.matmul(left_rows, right[part, :, columns], out=Q)
        clipped_exp(Q, clip)
        rows[part] += (Q @ weights_b[part, columns, None])[:, :, 0]
        if gradient:
            np.matmul(weighted[part], Q, out=products[part, :, columns])
    rows *= weights_a
    if gradient:
        products *= weights_b[:, None, :]
    return rows, products


def _exponent_factors(
    posterior: Posterior, block: _Block, inv_L: Array, K: Array, log_determinant: Array
) -> tuple[Array, Array, bool]:
    """Return [D_b T D_a Z'; e_a; 1] and [Z'; 1; e_b]: z_i'D_a T D_b z_j + e_ai + e_bj.

    The third value says whether an exponent may have to be clipped; T >= 0 bounds them.
    """
    T = -inv_L[:, :, None] * K * inv_L[:, None, :]
    count, size = inv_L.shape
    diagonals(T)[...] += inv_L
    packed = pack(T)
    factors = []
    lowest = 0.0
    for outputs, D, DD, z in (
        (block.a, block.D_a, block.DD_a, block.z_a),
        (block.b, block.D_b, block.DD_b, block.z_b),
    ):
        distances = z.scaled_distances(D)
        e = z.packed_forms(packed * DD) - distances
        e *= 0.5
        offsets = np.log(posterior.signal_variance[outputs]) - 0.25 * log_determinant
        e += offsets[:, None]
        factors.append(e)
        lowest += offsets.min() - 0.5 * distances.max()
    n = factors[0].shape[1]
    left, right = scratch("left", (count, size + 2, n)), scratch("right", (count, size + 2, n))
    np.matmul(
        block.D_b[:, :, None] * T * block.D_a[:, None, :], block.z_a.z[:, :size], out=left[:, :size]
    )
    left[:, size], left[:, size + 1] = factors[0], 1.0
    right[:, : size + 1], right[:, size + 1] = block.z_b.z, factors[1]
    return left, right, lies_below(lowest)


def _moments(block: _Block, rows: Array, products: Array) -> tuple[Array, Array]:
    """Return sum_ij Q_ij z_ij z_ij' (b, P, P) and D_a Z'r + D_b Z'c (b, P).

    The former up to its symmetric part, which is all that counts: it has twice Z'D_a Q D_b Z where
    that and its transpose belong.

    Args:
        block: The pairs.
        rows: r, of shape (b, n).
        products: Z'Q with c in the last row, of shape (b, P + 1, n).
    """
    size = block.D_a.shape[1]
    columns = np.ascontiguousarray(products[:, size])
    moment = products[:, :size] @ block.z_b.rows
    moment *= 2.0 * block.D_a[:, :, None]
    moment *= block.D_b[:, None, :]
    packed = block.DD_a * block.z_a.packed_moments(rows)
    packed += block.DD_b * block.z_b.packed_moments(columns)
    moment += unpack(packed, size)
    first = block.D_a * block.z_a.first_moments(rows)
    first += block.D_b * block.z_b.first_moments(columns)
    return moment, first
