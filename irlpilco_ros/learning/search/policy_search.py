"""Policy search: from the best of several starts, by Gauss-Newton, BFGS or L-BFGS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irlpilco_ros.learning.errors import InvalidSettingError, NumericalError
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.objective import Evaluation, Objective
from irlpilco_ros.learning.search.optimisers import (
    FIRST_DAMPING,
    OPTIMISERS,
    Optimiser,
    SearchProgress,
    Tracker,
)

_SCREENED_UP_TO = 30.0  # times the cost of the cheapest start


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
        optimiser: Name of one of `OPTIMISERS`.
        evaluations: Largest number of evaluations, on top of one for each start and of screening.
        progress: Told the best cost and the number of evaluations after each of them.
        screening: Evaluations for which each start of comparable cost is tried out before the
            best of them goes on; with 0 the cheapest start is improved.

    Raises:
        InvalidSettingError: if there is no such optimiser.
        NumericalError: if no start has a finite cost.
    """
    if optimiser not in OPTIMISERS:
        valid = ", ".join(OPTIMISERS)
        raise InvalidSettingError(f"optimiser is {optimiser!r}; valid: {valid}")
    minimise = OPTIMISERS[optimiser]
    tracker = Tracker(objective, len(starts) + evaluations, progress)
    evaluated = [tracker.evaluate(start) for start in starts]
    if tracker.best is None:
        raise NumericalError(
            f"none of {len(starts)} starting policies has a finite predicted cost; start from the "
            'policy with zero parameters as well (starts: "zero")'
        )
    best, damping = tracker.best, FIRST_DAMPING
    bound = _SCREENED_UP_TO * best.value
    candidates = [each for each in evaluated if each is not None and each.value <= bound]
    if screening and len(candidates) > 1:
        best, damping = _screen(tracker, candidates, minimise, screening)
    minimise(tracker, best, damping)
    return SearchResult(tracker.best.policy, tracker.best.value, tracker.evaluations)


def _screen(
    tracker: Tracker, starts: Sequence[Evaluation], minimise: Optimiser, evaluations: int
) -> tuple[Evaluation, float]:
    """Search a little from every start; return the best end, and its damping.

    The cheapest start is not always the best: the last policy may be saturated, so that no small
    change improves it, where a policy that does nothing can still become anything.
    """
    limit = tracker.limit + evaluations * (len(starts) - 1)
    ends = []
    for start in starts:
        tracker.limit = tracker.evaluations + evaluations
        ends.append(minimise(tracker, start, FIRST_DAMPING))
    tracker.limit = limit
    return min(ends, key=lambda end: end[0].value)
