"""Cholesky factors and inverses of stacks of positive-definite matrices.

numpy's batched routines release the GIL; scipy's LAPACK wrappers do not, so that threads over
outputs would wait for each other. numpy has no triangular inverse: the one here is made of
matrix products.
"""

from __future__ import annotations

import math
import threading
from functools import lru_cache

import numpy as np

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.numerics.threads import scratch

_one_at_a_time = threading.Lock()  # calls as short as an inversion's fight for the GIL
_SMALL = 12  # triangles of up to this size are LAPACK's, which has no special way with them
_WORTH_SPLITTING = 48  # triangles of up to this size are rather padded than split
_PADDING = 1.2  # larger ones too, to at most this times their size
_FIRST_JITTER = 1e-10
_LAST_JITTER = 1e-2


def triangular_inverse(factor: Array) -> Array:
    """Return the inverse of a lower triangular matrix, or of each of a stack (..., n, n)."""
    n = factor.shape[-1]
    return _inverses(factor.reshape(-1, n, n)).copy().reshape(factor.shape)


def _inverses(factors: Array) -> Array:
    """Return the inverses of lower triangles (k, n, n); they may lie in memory to be reused."""
    count, n, _ = factors.shape
    if n <= _SMALL:
        return np.asarray(np.linalg.inv(factors), dtype=np.float64)
    padded = 3 * _blocks(n)
    if n > _WORTH_SPLITTING and padded > _PADDING * n:
        return _split_inverses(factors, padded // 2)
    with _one_at_a_time:
        return _workspace(threading.get_ident(), count, n).inverses(factors)


def _blocks(n: int) -> int:
    """Return the smallest power of two whose blocks of 3 x 3 hold a triangle of size n."""
    return int(2 ** math.ceil(math.log2(n / 3)))


def _split_inverses(factors: Array, first: int) -> Array:
    """Return [[A, 0], [B, C]]^-1 = [[A^-1, 0], [-C^-1 B A^-1, C^-1]], with A of size `first`."""
    inverses = np.zeros_like(factors)
    a, b, c = inverses[:, :first, :first], inverses[:, first:, :first], inverses[:, first:, first:]
    np.negative(_inverses(factors[:, :first, :first]), out=a)  # which gives B its sign
    c[...] = _inverses(factors[:, first:, first:])
    np.matmul(c @ factors[:, first:, :first], a, out=b)
    np.negative(a, out=a)
    return inverses


@lru_cache(maxsize=16)
def _workspace(thread: int, count: int, n: int) -> _Halving:
    """Return a thread's own memory for inverting a stack of triangles of some size."""
    return _Halving(count, n)


class _Halving:
    """Inverts lower triangles, from small blocks on the diagonal to ever larger ones.

    [[A, 0], [B, C]]^-1 = [[A^-1, 0], [-C^-1 B A^-1, C^-1]] for all blocks of one size in all of
    the stack at once. The triangles are the corner of matrices as large as it takes to halve them
    down to blocks of 3 x 3; the rest is an identity. All views are made beforehand: what runs in
    between numpy's calls holds the GIL and keeps other threads from theirs.
    """

    def __init__(self, count: int, n: int) -> None:
        """Lay out memory for `count` triangles of size n."""
        size = 3 * _blocks(n)
        whole = np.empty((count, size, size))
        leaves = _diagonal_blocks(whole, 3)
        self._corner = whole[:, :n, :n]
        self._border = (whole[:, n:], whole[:, :n, n:])
        self._border_diagonal = diagonals(whole)[:, n:]
        self._diagonal = diagonals(whole)
        self._leaf = [[leaves[..., i, j] for j in range(3)] for i in range(3)]
        self._levels = []
        side = 3
        while side < size:
            pairs = _diagonal_blocks(whole, 2 * side)
            first, second = pairs[..., :side, :side], pairs[..., side:, side:]
            corner = pairs[..., side:, :side]
            self._levels.append((first, corner, second, np.empty(corner.shape)))
            side *= 2

    def inverses(self, factors: Array) -> Array:
        """Return the inverses of lower triangles (count, n, n), valid until the next call."""
        np.negative(factors, out=self._corner)  # which spares each product its sign
        for part in self._border:
            part.fill(0.0)
        self._border_diagonal.fill(-1.0)
        np.divide(-1.0, self._diagonal, out=self._diagonal)
        (a, _, _), (b, c, _), (d, e, f) = self._leaf
        b *= a
        b *= c
        d *= a
        d += e * b
        d *= f
        e *= c
        e *= f
        for first, corner, second, product in self._levels:
            np.matmul(second, corner, out=product)
            np.matmul(product, first, out=corner)
        return self._corner


def _diagonal_blocks(stack: Array, side: int) -> Array:
    """Return a view (k, b, side, side) of the blocks on the diagonals of a stack (k, n, n)."""
    count, size, _ = stack.shape
    outer, row, column = stack.strides
    return np.lib.stride_tricks.as_strided(
        stack, (count, size // side, side, side), (outer, side * (row + column), row, column)
    )


def diagonals(stack: Array) -> Array:
    """Return a view of the diagonals (k, n) of a contiguous stack of matrices (k, n, n)."""
    size = stack.shape[-1]
    return stack.reshape(-1, size * size)[:, :: size + 1]


def regularised_inverse(covariance: Array, regulariser: Array) -> tuple[Array, Array]:
    """Return (S + diag(d))^-1 and log |I + S diag(d)^-1| for several d at once.

    Args:
        covariance: S, of shape (P, P), positive semi-definite (it may be zero).
        regulariser: d > 0, of shape (k, P).

    Returns:
        Inverses of shape (k, P, P) and log determinants of shape (k,).

    Raises:
        NumericalError: if S + diag(d) is not positive definite.
    """
    lifted = scratch("lifted", (len(regulariser), *covariance.shape))
    lifted[...] = covariance
    diagonals(lifted)[...] += regulariser
    try:
        factor = np.asarray(np.linalg.cholesky(lifted), dtype=np.float64)
    except np.linalg.LinAlgError:
        smallest = float(np.linalg.eigvalsh(symmetric(covariance)).min())
        raise NumericalError(
            "the covariance of the dynamics model's input is not positive semi-definite: its "
            f"smallest eigenvalue is {smallest:.3g}, expected at least 0; pass a covariance"
        ) from None
    log_determinant = np.log(diagonals(factor) ** 2 / regulariser).sum(axis=1)
    inverse_factor = _inverses(factor)
    lifted[...] = inverse_factor  # A'A with twice the same A is a call of syrk, slower here
    return np.matmul(np.swapaxes(lifted, 1, 2), inverse_factor, out=factor), log_determinant


def jittered_cholesky(matrix: Array, scale: float) -> tuple[Array, float]:
    """Return the lower Cholesky factor of a matrix, with as much jitter as it takes.

    Args:
        matrix: Symmetric, of shape (n, n).
        scale: What the jitter is relative to, such as the signal variance.

    Returns:
        The factor of matrix + jitter * scale * I, and that jitter (0 if none was needed).

    Raises:
        NumericalError: if even a jitter of 0.01 does not make the matrix positive definite.
    """
    jitter = 0.0
    while jitter <= _LAST_JITTER:
        lifted = matrix + (jitter * scale) * np.eye(len(matrix)) if jitter else matrix
        factor: Array
        try:
            factor = np.asarray(np.linalg.cholesky(lifted), dtype=np.float64)
        except np.linalg.LinAlgError:
            factor = np.full(matrix.shape, np.nan)
        if np.isfinite(factor[-1, -1]):
            return factor, jitter
        jitter = max(10.0 * jitter, _FIRST_JITTER)
    raise NumericalError(
        f"a kernel matrix of {len(matrix)} points is not positive definite, even with "
        f"{_LAST_JITTER:g} of its scale {scale:.3g} added to the diagonal; "
        "check the data for non-finite or absurdly large values"
    )
