"""Policy search: from the best of several starts, by Gauss-Newton, BFGS or L-BFGS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.gaussian import Array
from irlpilco_ros.learning.objective import Evaluation, Objective
from irlpilco_ros.learning.policies import Policy

SearchProgress = Callable[[float, int], None]
"""Called with the best cost and the number of evaluations so far; may raise to cancel."""

_FIRST_DAMPING = 1e-3
_SMALLEST_DAMPING, _LARGEST_DAMPING = 1e-7, 1e9
_PATIENCE = 3
_SMALLEST_GAIN = 1e-3
_HOPELESS = 1e30
_FLAT = 1e-6


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Attributes:
        policy: The best policy.
        cost: Its predicted cost.
        evaluations: How often the objective was evaluated.
    """

    policy: Policy
    cost: float
    evaluations: int


class _Tracker:
    """Evaluates the objective, counts, remembers the best, and tells about it."""

    def __init__(self, objective: Objective, limit: int, progress: SearchProgress | None) -> None:
        self.objective = objective
        self.limit = limit
        self.progress = progress
        self.evaluations = 0
        self.best: Evaluation | None = None

    @property
    def exhausted(self) -> bool:
        return self.evaluations >= self.limit

    def evaluate(self, policy: Policy) -> Evaluation | None:
        """Return an evaluation, or None where the model has no finite answer."""
        self.evaluations += 1
        try:
            evaluation: Evaluation | None = self.objective.evaluate(policy)
        except NumericalError:
            evaluation = None
        if evaluation is not None and (self.best is None or evaluation.value < self.best.value):
            self.best = evaluation
        if self.progress is not None:
            self.progress(self.best.value if self.best else np.nan, self.evaluations)
        return evaluation


def search_policy(
    objective: Objective,
    starts: Sequence[Policy],
    optimiser: str,
    evaluations: int,
    progress: SearchProgress | None = None,
    race: int = 0,
) -> SearchResult:
    """Minimise the objective over the policy's parameters, from the best of several starts.

    Args:
        objective: J(theta).
        starts: Policies to start from; the one that costs least is improved.
        optimiser: "gauss_newton", "bfgs" or "lbfgs".
        evaluations: Largest number of evaluations, on top of one for each start.
        progress: Told the best cost and the number of evaluations after each of them.
        race: Evaluations, of those, in which each of several starts is improved before the best
            of them goes on; with 0 the best start is chosen as it stands.

    Raises:
        NumericalError: if no start has a finite cost.
    """
    limit = len(starts) + evaluations
    tracker = _Tracker(objective, limit, progress)
    for start in starts:
        evaluation = tracker.evaluate(start)
        if evaluation is not None and race and len(starts) > 1:
            tracker.limit = min(tracker.evaluations + race, limit)
            _improve(tracker, evaluation, optimiser)
            tracker.limit = limit
    if tracker.best is None:
        raise NumericalError(
            f"none of {len(starts)} starting policies has a finite predicted cost; start from the "
            'policy with zero parameters as well (starts: "zero")'
        )
    _improve(tracker, tracker.best, optimiser)
    return SearchResult(tracker.best.policy, tracker.best.value, tracker.evaluations)


def _improve(tracker: _Tracker, start: Evaluation, optimiser: str) -> None:
    """Search on from a start until the tracker's evaluations are used up or nothing is gained."""
    if optimiser == "gauss_newton":
        _gauss_newton(tracker, start)
    else:
        _quasi_newton(tracker, start, optimiser)


def _gauss_newton(tracker: _Tracker, current: Evaluation) -> None:
    """Levenberg-Marquardt: the exact gradient, the curvature of means and gains."""
    damping, patience = _FIRST_DAMPING, _PATIENCE
    while patience > 0:
        better, damping = _damped_descent(tracker, current, damping)
        if better is None:
            return
        gain = current.value - better.value
        small = gain < _SMALLEST_GAIN * abs(current.value)
        patience = patience - 1 if small else _PATIENCE
        current = better


def _damped_descent(
    tracker: _Tracker, current: Evaluation, damping: float
) -> tuple[Evaluation | None, float]:
    """Return the first better evaluation as damping grows (None if none), and the next damping."""
    theta, gradient, curvature = (
        current.policy.parameters,
        current.gradient(),
        current.curvature(),
    )
    while not tracker.exhausted and damping <= _LARGEST_DAMPING:
        step = _damped_step(curvature, gradient, damping)
        if step is not None:
            candidate = tracker.evaluate(current.policy.with_parameters(theta - step))
            if candidate is not None and candidate.value < current.value:
                return candidate, max(damping / 5.0, _SMALLEST_DAMPING)
        damping *= 8.0
    return None, damping


def _damped_step(curvature: Array, gradient: Array, damping: float) -> Array | None:
    """Solve (C + d I) step = gradient, d being the damping times the mean curvature.

    None if that has no finite solution at this damping.
    """
    damped = curvature.copy()
    scale = float(np.trace(curvature)) / len(gradient)
    damped[np.diag_indices_from(damped)] += damping * scale + 1e-12
    try:
        factor = linalg.cho_factor(damped, overwrite_a=True)
        step: Array = linalg.cho_solve(factor, gradient)
    except (linalg.LinAlgError, ValueError):  # indefinite by rounding, or not finite
        return None
    return step if np.isfinite(step).all() else None


def _quasi_newton(tracker: _Tracker, start: Evaluation, optimiser: str) -> None:
    """BFGS (PILCO's way) or L-BFGS (the thesis's), which need the gradient alone."""
    limit = 10 * tracker.limit  # never the first to be reached
    options = {
        "bfgs": {"method": "BFGS", "options": {"maxiter": limit, "gtol": _FLAT}},
        "lbfgs": {
            "method": "L-BFGS-B",
            "options": {"maxfun": limit, "maxiter": limit, "maxcor": 30},
        },
    }

    class _ExhaustedError(Exception):
        pass

    def objective(theta: Array) -> tuple[float, Array]:
        if tracker.exhausted:
            raise _ExhaustedError
        if not np.isfinite(theta).all():
            return _HOPELESS, np.zeros_like(theta)
        evaluation = tracker.evaluate(start.policy.with_parameters(theta))
        if evaluation is None:
            return _HOPELESS, np.zeros_like(theta)
        return evaluation.value, evaluation.gradient()

    try:
        optimize.minimize(
            objective,
            start.policy.parameters,
            jac=True,
            **options[optimiser],
        )
    except _ExhaustedError:
        return
