"""Cost weights from the trials so far (thesis (4.5)-(4.6); Abbeel & Ng 2004).

The expert's deviation from itself is zero, and the cost is linear in a trial's squared
deviations psi. Max-margin is then: max t s.t. w'psi_j >= t for every trial j, |w| <= 1. Its dual
is the point v of least norm in the convex hull of the psi_j: w = v / |v|, t = |v|. So w >= 0,
and the margin t never grows when a trial is added.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

_SMALLEST_MARGIN = 1e-300


def max_margin(deviations: Array) -> tuple[Array, float]:
    """Return the weights that tell the expert from all trials by the largest margin.

    Args:
        deviations: psi_j >= 0 of every trial j, shape (n, k).

    Returns:
        Weights w >= 0 with |w| = 1, shape (k,), and the margin. If a mixture of trials has no
        deviation at all, the weights are equal and the margin is 0.
    """
    return _weights_and_margin(minimum_norm_point(deviations))


def projection(deviations: Array) -> tuple[Array, float]:
    """Return the weights of Abbeel & Ng's projection algorithm, one step for each trial.

    Args:
        deviations: psi_j >= 0 of every trial j in the order they were made, shape (n, k).
    """
    point = deviations[0]
    for psi in deviations[1:]:
        direction = psi - point
        length = float(direction @ direction)
        step = -float(point @ direction) / length if length > 0.0 else 0.0
        point = point + float(np.clip(step, 0.0, 1.0)) * direction
    return _weights_and_margin(point)


def latest(deviations: Array) -> tuple[Array, float]:
    """Return the weights that tell the expert from the most recent trial alone (the thesis)."""
    return _weights_and_margin(deviations[-1])


def uniform(deviations: Array) -> tuple[Array, float]:
    """Return equal weights; the margin is that of the best trial under them."""
    k = deviations.shape[1]
    weights = np.full(k, 1.0 / np.sqrt(k))
    return weights, float((deviations @ weights).min())


WEIGHT_RULES: Mapping[str, Callable[[Array], tuple[Array, float]]] = {
    "max_margin": max_margin,
    "projection": projection,
    "latest": latest,
    "uniform": uniform,
}


def minimum_norm_point(points: Array) -> Array:
    """Return the point of least Euclidean norm in the convex hull of points (n, k).

    Non-negative least squares finds the mixture: minimise |P'c|^2 + (1'c - 1)^2 over c >= 0,
    whose solution is the wanted mixture up to its length.
    """
    from scipy import optimize  # late: it takes as long as all else here

    size = float(np.abs(points).max())
    if size == 0.0:
        return np.zeros(points.shape[1])
    system = np.vstack([points.T / size, np.ones(len(points))])
    target = np.zeros(len(system))
    target[-1] = 1.0
    mixture, _ = optimize.nnls(system, target)
    point: Array = (mixture / mixture.sum()) @ points
    return point


def _weights_and_margin(point: Array) -> tuple[Array, float]:
    margin = float(np.linalg.norm(point))
    if margin < _SMALLEST_MARGIN:
        return np.full(len(point), 1.0 / np.sqrt(len(point))), 0.0
    return point / margin, margin
