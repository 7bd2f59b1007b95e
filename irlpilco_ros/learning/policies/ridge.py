"""Ridge regression, by which policies are fitted to controls."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

BUMP_RIDGE = 1e-4
"""Of the bumps' mean square: bumps that overlap share the work."""


def ridge(inputs: Array, targets: Array, regulariser: float) -> Array:
    """Return the coefficients (k, F) for inputs (n, k) and targets (n, F).

    The regulariser is relative to the inputs' mean square.
    """
    gram: Array = inputs.T @ inputs
    gram += regulariser * max(float(np.trace(gram)), 1e-12) / len(gram) * np.eye(len(gram))
    return np.asarray(np.linalg.solve(gram, inputs.T @ targets), dtype=np.float64)
