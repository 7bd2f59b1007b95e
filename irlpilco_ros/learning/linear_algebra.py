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

_SMALL = 6  # below this size LAPACK's general inverse is as fast as splitting further
_FIRST_JITTER = 1e-10
_LAST_JITTER = 1e-2


def triangular_inverse(factor: Array) -> Array:
    """Return the inverse of a lower triangular matrix, or of each of a stack (..., n, n).

    [[A, 0], [B, C]]^-1 = [[A^-1, 0], [-C^-1 B A^-1, C^-1]], halving until the blocks are small.
    """
    result = np.zeros_like(factor)
    _invert_triangle(factor, result)
    return result


def _invert_triangle(factor: Array, result: Array) -> None:
    n = factor.shape[-1]
    if n <= _SMALL:
        result[...] = np.linalg.inv(factor)
        return
    half = n // 2
    _invert_triangle(factor[..., :half, :half], result[..., :half, :half])
    _invert_triangle(factor[..., half:, half:], result[..., half:, half:])
    corner = np.matmul(factor[..., half:, :half], result[..., :half, :half])
    np.matmul(result[..., half:, half:], -corner, out=result[..., half:, :half])


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
    scale = 1.0 / np.sqrt(regulariser)
    scales = scale[:, :, None] * scale[:, None, :]
    scaled = np.multiply(covariance, scales, out=scratch("scaled", scales.shape))
    diagonals(scaled)[...] += 1.0
    try:
        factor = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        smallest = float(np.linalg.eigvalsh(symmetric(covariance)).min())
        raise NumericalError(
            "the covariance of the dynamics model's input is not positive semi-definite: its "
            f"smallest eigenvalue is {smallest:.3g}, expected at least 0; pass a covariance"
        ) from None
    log_determinant = 2.0 * np.log(diagonals(factor)).sum(axis=1)
    inverse_factor = scratch("scaled", factor.shape)
    inverse_factor[...] = 0.0
    _invert_triangle(factor, inverse_factor)
    inverse = np.matmul(np.swapaxes(inverse_factor, 1, 2), inverse_factor, out=factor)
    inverse *= scales
    return inverse, log_determinant


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
