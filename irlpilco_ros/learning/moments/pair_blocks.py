"""Matrices over all pairs of points, cut into blocks that stay in the processor's cache."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.sharing import even_slices

_STRIP = 60  # columns of an n x n matrix that are worked on together
_CACHED_ELEMENTS = 450_000  # n x n values whose strips stay in the cache together

_SMALLEST_EXPONENT = -500.0
"""Exponents are clipped here: exp(-500) is nothing, but denormal numbers are 20 times slower."""


def column_strips(n: int) -> tuple[slice, ...]:
    """Cut the columns of an n x n matrix into strips of about equal width."""
    return even_slices(n, max(1, round(n / _STRIP)))


def cached_parts(count: int, n: int) -> list[slice]:
    """Cut a stack of n x n matrices into parts that fit into the cache, a strip at a time."""
    step = max(1, _CACHED_ELEMENTS // n**2)
    return [slice(start, min(start + step, count)) for start in range(0, count, step)]


def pair_weights(weights: Array, inverse: Array) -> tuple[Array, ...]:
    """Return beta beta' - K^-1, symmetric, in strips of columns for sums over all pairs.

    Each strip is an array of its own, in memory as it is read, and ends with its diagonal block:
    what is above that is doubled, for its mirror image.

    Args:
        weights: beta, of shape (b, n).
        inverse: K^-1, of shape (b, n, n).

    Returns:
        For each strip an array of shape (b, stop, stop - start).
    """
    found = []
    for strip in column_strips(weights.shape[1]):
        block = weights[:, : strip.stop, None] * weights[:, None, strip]
        block -= inverse[:, : strip.stop, strip]
        block[:, : strip.start] *= 2.0
        found.append(block)
    return tuple(found)


def lies_below(lowest: float) -> bool:
    """Say whether exponents that may be as low as this have to be clipped."""
    return bool(lowest < _SMALLEST_EXPONENT)


def clipped_exp(exponents: Array, clip: bool = True) -> Array:
    """Return exp(max(exponents, the smallest one)), in place."""
    if clip:
        np.maximum(exponents, _SMALLEST_EXPONENT, out=exponents)
    return np.exp(exponents, out=exponents)
