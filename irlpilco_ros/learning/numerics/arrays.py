"""The arrays that everything here is made of."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]


def symmetric(matrix: Array) -> Array:
    """Return the symmetric part of a matrix, or of each matrix of a stack (..., n, n)."""
    result = matrix + matrix.swapaxes(-1, -2)
    result *= 0.5
    return result
