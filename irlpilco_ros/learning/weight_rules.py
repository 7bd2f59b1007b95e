"""Cost weights from the trials so far (thesis (4.5)-(4.6); Abbeel & Ng 2004).

The expert's deviation from itself is zero, and the cost is linear in a trial's squared
deviations psi. Max-margin is then: max t s.t. w'psi_j >= t for every trial j, |w| <= 1. Its dual
is the point v of least norm in the convex hull of the psi_j: w = v / |v|, t = |v|. So w >= 0,
and the margin t never grows when a trial is added.

Several demonstrations are not their mean, psi = 0, themselves: the expert's own deviation psi_E is
the mean of theirs, as Abbeel & Ng's feature expectations of the expert are. Over that the margin is
max t s.t. w'(psi_j - psi_E) >= t, |w| <= 1, w >= 0 (`max_margin_spread`). Where demonstrations
differ by more than trials are off, psi_j < psi_E, and w >= 0 has to be asked for: a deviation never
earns anything (that the signs of weights are known is Syed & Schapire's assumption, 2007). The dual
is the point v of least norm that lies in the convex hull of the psi_j - psi_E, or above a point of
it: features that tell no trial from what was shown get no weight.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

_SMALLEST_MARGIN = 1e-300
_ROUNDING = 1e-12


def max_margin(deviations: Array) -> tuple[Array, float]:
    """Return the weights that tell the expert from all trials by the largest margin.

    Args:
        deviations: psi_j >= 0 of every trial j, shape (n, k).

    Returns:
        Weights w >= 0 with |w| = 1, shape (k,), and the margin. If a mixture of trials has no
        deviation at all, the weights are equal and the margin is 0.
    """
    return _weights_and_margin(minimum_norm_point(deviations))


def max_margin_spread(deviations: Array, expert: Array) -> tuple[Array, float]:
    """Return the weights that tell the demonstrations, as they differ, from all trials at best.

    Args:
        deviations: psi_j >= 0 of every trial j, shape (n, k).
        expert: psi_E >= 0, the mean deviation of the demonstrations from their mean, as it is to be
            compared with each trial, shape (n, k); zeros for a single one: it is `max_margin` then.

    Returns:
        Weights w >= 0 with |w| = 1, shape (k,), and the margin. If a mixture of trials is nowhere
        further off than the demonstrations, the weights are equal and the margin is 0: by no cost
        that is a weighted sum of these features does the expert do better.
    """
    excess = deviations - expert
    point = minimum_norm_point(excess, or_above=True)
    point[point <= _ROUNDING * np.abs(excess).max()] = 0.0
    return _weights_and_margin(point)


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


def _of_trials_alone(rule: Callable[[Array], tuple[Array, float]]) -> WeightRule:
    """Return a rule that takes the demonstrations for one."""
    return lambda deviations, _: rule(deviations)


WeightRule = Callable[[Array, Array], tuple[Array, float]]
"""From psi_j of all trials (n, k) and psi_E beside each (n, k) to weights (k,) and margin."""

WEIGHT_RULES: Mapping[str, WeightRule] = {
    "max_margin": _of_trials_alone(max_margin),
    "max_margin_spread": max_margin_spread,
    "projection": _of_trials_alone(projection),
    "latest": _of_trials_alone(latest),
    "uniform": _of_trials_alone(uniform),
}


def minimum_norm_point(points: Array, or_above: bool = False) -> Array:
    """Return the point of least Euclidean norm in the convex hull of points (n, k).

    Non-negative least squares finds the mixture: minimise |P'c|^2 + (1'c - 1)^2 over c >= 0,
    whose solution is the wanted mixture up to its length.

    Args:
        points: Shape (n, k).
        or_above: Whether the points above the hull count, too, v >= P'c: minimise
            |P'c + s|^2 + (1'c - 1)^2 over s >= 0 as well.
    """
    from scipy import optimize  # late: it takes as long as all else here

    size = float(np.abs(points).max())
    if size == 0.0:
        return np.zeros(points.shape[1])
    count, k = points.shape
    system = np.vstack([points.T / size, np.ones(count)])
    if or_above:
        system = np.hstack([system, np.eye(k + 1, k)])
    target = np.zeros(len(system))
    target[-1] = 1.0
    mixture, _ = optimize.nnls(system, target)
    shares = mixture[:count] / mixture[:count].sum()
    point: Array = shares @ points
    return np.maximum(point, 0.0) if or_above else point


def _weights_and_margin(point: Array) -> tuple[Array, float]:
    margin = float(np.linalg.norm(point))
    if margin < _SMALLEST_MARGIN:
        return np.full(len(point), 1.0 / np.sqrt(len(point))), 0.0
    return point / margin, margin
