"""Cholesky factors and inverses of stacks of positive-definite matrices.

numpy's batched routines release the GIL; scipy's LAPACK wrappers do not, so that threads over
outputs would wait for each other. numpy has no triangular inverse: the one here is made of
matrix products.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.gaussian import Array, symmetric
from irlpilco_ros.learning.threads import scratch

_SMALL = 12  # triangles of up to this size are LAPACK's, which has no special way with them
_LEAF = 3  # the smallest blocks of larger ones are inverted row by row
_FIRST_JITTER = 1e-10
_LAST_JITTER = 1e-2


def triangular_inverse(factor: Array) -> Array:
    """Return the inverse of a lower triangular matrix, or of each of a stack (..., n, n).

    [[A, 0], [B, C]]^-1 = [[A^-1, 0], [-C^-1 B A^-1, C^-1]], from small blocks on the diagonal to
    ever larger ones: few calls of numpy, each for all blocks of one size in all of the stack.
    """
    n = factor.shape[-1]
    return _inverses(factor.reshape(-1, n, n)).copy().reshape(factor.shape)


def _inverses(factors: Array) -> Array:
    """Return the inverses of lower triangles (k, n, n); they may lie in scratch memory.

    There they are the corner of matrices as large as it takes to halve them down to small blocks;
    the rest is an identity.
    """
    count, n, _ = factors.shape
    if n <= _SMALL:
        return np.asarray(np.linalg.inv(factors), dtype=np.float64)
    blocks = 1
    while n > _LEAF * blocks:
        blocks *= 2
    side = -(-n // blocks)
    size = side * blocks
    result = scratch("padded", (count, size, size))
    np.negative(factors, out=result[:, :n, :n])  # which spares each product its sign
    result[:, :n, n:], result[:, n:, :n], result[:, n:, n:] = 0.0, 0.0, -np.eye(size - n)
    leaves = _diagonal_blocks(result, side, side)
    for i in range(side):
        leaves[..., i, i] = -1.0 / leaves[..., i, i]
        if i:
            row = leaves[..., i : i + 1, :i] @ leaves[..., :i, :i]
            leaves[..., i : i + 1, :i] = row * leaves[..., i : i + 1, i : i + 1]
    while side < size:
        first = _diagonal_blocks(result, side, 2 * side)
        corner = _diagonal_blocks(result[:, side:], side, 2 * side)
        second = _diagonal_blocks(result[:, side:, side:], side, 2 * side)
        corner[...] = second @ corner @ first
        side *= 2
    return result[:, :n, :n]


def _diagonal_blocks(stack: Array, side: int, step: int) -> Array:
    """Return a view (k, b, side, side) of every block at (i step, i step) of each matrix."""
    count, rows, _ = stack.shape
    outer, row, column = stack.strides
    shape = (count, -(-rows // step), side, side)
    return np.lib.stride_tricks.as_strided(
        stack, shape, (outer, step * (row + column), row, column)
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
    return np.matmul(np.swapaxes(inverse_factor, 1, 2), inverse_factor, out=factor), log_determinant


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
