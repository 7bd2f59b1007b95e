"""Policy search for a given cost: first over the beginning of a trial, then over all of it."""

from __future__ import annotations

import dataclasses
import math

from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.search.optimisers import SearchProgress
from irlpilco_ros.learning.search.policy_search import SearchResult, search_policy

BEGINNING = 2.0 / 3.0  # of a trial


def total_evaluations(evaluations: int) -> int:
    """Return how many evaluations the search may take: half as many over the beginning first."""
    return evaluations + evaluations // 2


def search_beginning_first(
    objective: Objective,
    policy: Policy,
    optimiser: str,
    evaluations: int,
    progress: SearchProgress | None = None,
) -> SearchResult:
    """Search on from a policy, first for what is cheap over the beginning of the trial.

    Over the whole trial there are local optima that get to the target in the end, after a detour
    that no small change makes shorter. Over the beginning alone such a detour is worth nothing.

    Args:
        objective: J(theta) over the whole trial.
        policy: Where to start.
        optimiser: As `search_policy`.
        evaluations: Of the second search; the first has half as many.
        progress: Told the best cost of the search under way, and the evaluations of both.

    Raises:
        NumericalError: if no finite prediction can be made.
    """
    beginning = dataclasses.replace(objective, horizon=math.ceil(BEGINNING * objective.horizon))
    first = total_evaluations(evaluations) - evaluations
    early = search_policy(beginning, [policy], optimiser, first, progress)

    def tell(cost: float, more: int) -> None:
        if progress is not None:
            progress(cost, early.evaluations + more)

    found = search_policy(objective, [early.policy], optimiser, evaluations, tell)
    return dataclasses.replace(found, evaluations=early.evaluations + found.evaluations)
