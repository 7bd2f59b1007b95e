"""Policy search: from the best of several starts, by Gauss-Newton, BFGS or L-BFGS."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.objective import Evaluation, Objective

SearchProgress = Callable[[float, int], None]
"""Called with the best cost and the number of evaluations so far; may raise to cancel."""

_FIRST_DAMPING = 3e-2
_SMALLEST_DAMPING, _LARGEST_DAMPING = 1e-7, 1e9
_PATIENCE = 3
_SMALLEST_GAIN = 1e-3
_HOPELESS = 1e30
_FLAT = 1e-6
_LIFT = 1e-7
_RIVAL = 30.0  # a start that costs more than this times the cheapest one is not tried out


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


def search_policy(
    objective: Objective,
    starts: Sequence[Policy],
    optimiser: str,
    evaluations: int,
    progress: SearchProgress | None = None,
    screening: int = 0,
) -> SearchResult:
    """Minimise the objective over the policy's parameters, from the best of several starts.

    Args:
        objective: J(theta).
        starts: Policies to start from.
        optimiser: "gauss_newton", "bfgs" or "lbfgs".
        evaluations: Largest number of evaluations, on top of one for each start and of screening.
        progress: Told the best cost and the number of evaluations after each of them.
        screening: Evaluations for which each start of comparable cost is tried out before the
            best of them goes on; with 0 the cheapest start is improved.

    Raises:
        NumericalError: if no start has a finite cost.
    """
    tracker = _Tracker(objective, len(starts) + evaluations, progress)
    evaluated = [tracker.evaluate(start) for start in starts]
    if tracker.best is None:
        raise NumericalError(
            f"none of {len(starts)} starting policies has a finite predicted cost; start from the "
            'policy with zero parameters as well (starts: "zero")'
        )
    best, damping = tracker.best, _FIRST_DAMPING
    rivals = [each for each in evaluated if each is not None and each.value <= _RIVAL * best.value]
    if screening and len(rivals) > 1:
        best, damping = _screen(tracker, rivals, optimiser, screening)
    _improve(tracker, best, optimiser, damping)
    return SearchResult(tracker.best.policy, tracker.best.value, tracker.evaluations)


def _screen(
    tracker: _Tracker, rivals: Sequence[Evaluation], optimiser: str, tries: int
) -> tuple[Evaluation, float]:
    """Try out every rival, and return where the best one led, with its damping.

    The cheapest start is not always the best: the last policy may be saturated, so that no small
    change improves it, where a policy that does nothing can still become anything.
    """
    limit = tracker.limit + tries * (len(rivals) - 1)
    led = []
    for rival in rivals:
        tracker.limit = tracker.evaluations + tries
        led.append(_improve(tracker, rival, optimiser, _FIRST_DAMPING))
    tracker.limit = limit
    return min(led, key=lambda end: end[0].value)


def _improve(
    tracker: _Tracker, start: Evaluation, optimiser: str, damping: float
) -> tuple[Evaluation, float]:
    """Search on from a start until the tracker's evaluations are used up or nothing is gained.

    Returns:
        The best evaluation that followed from this start, and the next damping.
    """
    if optimiser == "gauss_newton":
        return _gauss_newton(tracker, start, damping)
    return _quasi_newton(tracker, start, optimiser), damping


def _gauss_newton(
    tracker: _Tracker, current: Evaluation, damping: float
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
        gain = current.value - better.value
        small = gain < _SMALLEST_GAIN * abs(current.value)
        patience = patience - 1 if small else _PATIENCE
        current = better
    return current, damping


def _damped_descent(
    tracker: _Tracker, current: Evaluation, damping: float
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
                promised = float(gradient @ step - 0.5 * step @ curvature @ step)
                kept = (current.value - candidate.value) / promised
                return candidate, _next_damping(damping, kept)
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


def _next_damping(damping: float, kept: float) -> float:
    """Return the damping of the next step, given how much of its promise the last one kept."""
    if kept > 0.75:
        return max(damping / 5.0, _SMALLEST_DAMPING)
    return damping if kept > 0.25 else 3.0 * damping


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


def _quasi_newton(tracker: _Tracker, start: Evaluation, optimiser: str) -> Evaluation:
    """BFGS (PILCO's way) or L-BFGS (the thesis's), which need the gradient alone.

    Returns:
        The best evaluation that followed from this start.
    """
    from scipy import optimize  # late: it takes as long as all else here

    best = start
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
        nonlocal best
        if tracker.exhausted:
            raise _ExhaustedError
        if not np.isfinite(theta).all():
            return _HOPELESS, np.zeros_like(theta)
        evaluation = tracker.evaluate(start.policy.with_parameters(theta))
        if evaluation is None:
            return _HOPELESS, np.zeros_like(theta)
        if evaluation.value < best.value:
            best = evaluation
        return evaluation.value, evaluation.gradient()

    with contextlib.suppress(_ExhaustedError):
        optimize.minimize(objective, start.policy.parameters, jac=True, **options[optimiser])
    return best
