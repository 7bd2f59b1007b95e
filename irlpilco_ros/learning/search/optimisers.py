"""Optimisers of policy search: Gauss-Newton, BFGS, and L-BFGS of parameters plain or scaled."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.objective import Evaluation, Objective

SearchProgress = Callable[[float, int], None]
"""Called with the best cost and the number of evaluations so far; may raise to cancel."""

FIRST_DAMPING = 3e-2
_SMALLEST_DAMPING, _LARGEST_DAMPING = 1e-7, 1e9
_PATIENCE = 3  # steps that hardly improve the cost, before the search ends
_SMALLEST_REDUCTION = 1e-3  # of the cost, in one step
_FLAT = 1e-6
_UNLIMITED = 10**9  # for scipy: the tracker counts evaluations
_LIFT = 1e-7
_ROUND = 1e-6  # of the change metric's mean: keeps apart what the start's states cannot tell apart


class Tracker:
    """Evaluates the objective, counts evaluations, keeps the best and reports progress."""

    def __init__(self, objective: Objective, limit: int, progress: SearchProgress | None) -> None:
        self.objective = objective
        self.limit = limit
        self.progress = progress
        self.evaluations = 0
        self.best: Evaluation | None = None

    @property
    def exhausted(self) -> bool:
        """Whether no evaluation is left."""
        return self.evaluations >= self.limit

    def evaluate(self, policy: Policy) -> Evaluation | None:
        """Return an evaluation, or None where the model has no finite answer."""
        self.evaluations += 1
        try:
            # A line search may step to where numbers overflow: the error says all there is to say.
            with np.errstate(all="ignore"):
                evaluation: Evaluation | None = self.objective.evaluate(policy)
        except NumericalError:
            evaluation = None
        if evaluation is not None and (self.best is None or evaluation.value < self.best.value):
            self.best = evaluation
        if self.progress is not None:
            self.progress(self.best.value if self.best else np.nan, self.evaluations)
        return evaluation


def _gauss_newton(
    tracker: Tracker, current: Evaluation, damping: float
) -> tuple[Evaluation, float]:
    """Levenberg-Marquardt: the exact gradient, the curvature of means and gains.

    Returns:
        The best evaluation and the next damping.
    """
    patience = _PATIENCE
    while patience > 0 and not tracker.exhausted:
        better, damping = _damped_descent(tracker, current, damping)
        if better is None:
            break
        reduction = current.value - better.value
        small = reduction < _SMALLEST_REDUCTION * abs(current.value)
        patience = patience - 1 if small else _PATIENCE
        current = better
    return current, damping


def _damped_descent(
    tracker: Tracker, current: Evaluation, damping: float
) -> tuple[Evaluation | None, float]:
    """Return the first better evaluation as damping grows (None if none), and the next damping."""
    theta, gradient, curvature = (
        current.policy.parameters,
        current.gradient(),
        current.curvature(),
    )
    metric = _damping_metric(current, curvature)
    while not tracker.exhausted and damping <= _LARGEST_DAMPING:
        step = _damped_step(curvature + damping * metric, gradient)
        if step is not None:
            candidate = tracker.evaluate(current.policy.with_parameters(theta - step))
            if candidate is not None and candidate.value < current.value:
                predicted = float(gradient @ step - 0.5 * step @ curvature @ step)
                gain_ratio = (current.value - candidate.value) / predicted
                return candidate, _next_damping(damping, gain_ratio)
        damping *= 4.0
    return None, damping


def _damping_metric(current: Evaluation, curvature: Array) -> Array:
    """Return what damping multiplies, as large as the curvature (equal traces).

    It limits how far a step changes the controls, wherever the policy knows that, rather than the
    parameters: of these, many combinations hardly matter, and others a lot.
    """
    metric = current.change_metric()
    if metric is None:
        metric = np.eye(len(curvature))
    scaled: Array = metric * (float(np.trace(curvature)) / float(np.trace(metric)))
    return scaled


def _next_damping(damping: float, gain_ratio: float) -> float:
    """Return the damping of the next step, given the last one's actual over predicted reduction."""
    if gain_ratio > 0.75:
        return max(damping / 5.0, _SMALLEST_DAMPING)
    return damping if gain_ratio > 0.25 else 3.0 * damping


def _damped_step(damped: Array, gradient: Array) -> Array | None:
    """Solve damped step = gradient; None if that has no finite solution.

    The lift is for directions that change nothing: no curvature, no gradient, no damping.
    """
    from scipy import linalg  # late: it takes as long as all else here

    lifted = damped.copy()
    lifted[np.diag_indices_from(lifted)] += _LIFT * float(np.trace(damped)) / len(gradient) + 1e-12
    try:
        factor = linalg.cho_factor(lifted, overwrite_a=True)
        step: Array = linalg.cho_solve(factor, gradient)
    except (linalg.LinAlgError, ValueError):  # indefinite by rounding, or not finite
        return None
    return step if np.isfinite(step).all() else None


@dataclass(frozen=True)
class _Coordinates:
    """z = root' theta, in which a quasi-Newton method searches.

    Attributes:
        root: Lower triangular, shape (p, p); None for the parameters theta as they are.
    """

    root: Array | None = None

    @classmethod
    def of_controls(cls, start: Evaluation) -> _Coordinates:
        """Return those in which a step of unit length changes the controls by as much anywhere.

        A joint that stands at 1.7 rad makes a second bias of its gain, which moves the controls a
        hundred times as much as what the gain does about the joint's own motion: a search by
        gradients of the gains themselves sees little else. Of a policy that does not know its
        `change_metric` these are the parameters as they are.
        """
        metric = start.change_metric()
        if metric is None:
            return cls()
        size = float(np.trace(metric)) / len(metric)
        lifted = metric / size + _ROUND * np.eye(len(metric))
        return cls(np.asarray(np.linalg.cholesky(lifted), dtype=float))

    def of(self, theta: Array) -> Array:
        """Return z (p,) of theta."""
        return theta if self.root is None else self.root.T @ theta

    def parameters(self, z: Array) -> Array:
        """Return theta (p,) of z."""
        return z if self.root is None else _triangular(self.root.T, z, lower=False)

    def slope(self, gradient: Array) -> Array:
        """Return the gradient by z of the one by theta."""
        return gradient if self.root is None else _triangular(self.root, gradient, lower=True)


def _triangular(matrix: Array, right: Array, lower: bool) -> Array:
    """Return the solution of matrix x = right."""
    from scipy import linalg  # late: it takes as long as all else here

    solution: Array = linalg.solve_triangular(matrix, right, lower=lower, check_finite=False)
    return solution


def _quasi_newton(
    tracker: Tracker,
    start: Evaluation,
    damping: float,
    method: str,
    options: Mapping[str, Any],
    scaled: bool = False,
) -> tuple[Evaluation, float]:
    """BFGS (as PILCO) or L-BFGS (as the thesis), which need the gradient alone, and no damping.

    They search the parameters themselves, or scaled by what they do to the controls.

    Where the model has no finite answer, the cost is taken for the mirror image of what it is at
    the best point so far: as high, and rising as steeply towards there as it falls from it. The
    interpolation of a line search then halves the step, where any huge number would make it 0.
    """
    from scipy import optimize  # late: it takes as long as all else here

    best = start
    coordinates = _Coordinates.of_controls(start) if scaled else _Coordinates()

    class _ExhaustedError(Exception):
        pass

    def objective(z: Array) -> tuple[float, Array]:
        nonlocal best
        if tracker.exhausted:
            raise _ExhaustedError
        evaluation, theta = None, coordinates.parameters(z)
        if np.isfinite(theta).all():
            evaluation = tracker.evaluate(start.policy.with_parameters(theta))
        if evaluation is None:
            return best.value, -coordinates.slope(best.gradient())
        if evaluation.value < best.value:
            best = evaluation
        return evaluation.value, coordinates.slope(evaluation.gradient())

    with contextlib.suppress(_ExhaustedError):
        optimize.minimize(
            objective,
            coordinates.of(start.policy.parameters),
            jac=True,
            method=method,
            options={"maxiter": _UNLIMITED, **options},
        )
    return best, damping


Optimiser: TypeAlias = Callable[[Tracker, Evaluation, float], tuple[Evaluation, float]]
"""(tracker, start, damping) -> the best evaluation that followed from the start, next damping.

Goes on until the tracker's evaluations are used up or the cost hardly falls."""

_LBFGS = partial(_quasi_newton, method="L-BFGS-B", options={"maxfun": _UNLIMITED, "maxcor": 30})

OPTIMISERS: Mapping[str, Optimiser] = {
    "gauss_newton": _gauss_newton,
    "bfgs": partial(_quasi_newton, method="BFGS", options={"gtol": _FLAT}),
    "lbfgs": _LBFGS,
    "scaled_lbfgs": partial(_LBFGS, scaled=True),
}
