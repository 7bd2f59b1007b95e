"""Policy search for a given cost with a second start, for when the first one leads nowhere."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.search.beginning_first import (
    BEGINNING,
    total_evaluations,
)
from irlpilco_ros.learning.search.optimisers import SearchProgress
from irlpilco_ros.learning.search.policy_search import SearchResult, search_policy

_GETTING_THERE = 0.43  # of a trial: too short for anything but the straightest way
_THERE = 0.25  # of what the start costs; a state that costs less is about where it should be


def most_evaluations(evaluations: int) -> int:
    """Return how many evaluations the search may take: three beginnings, then all of it twice."""
    return 2 * evaluations + 3 * (total_evaluations(evaluations) - evaluations)


def search_with_second_start(
    objective: Objective,
    starts: Sequence[Policy],
    optimiser: str,
    evaluations: int,
    progress: SearchProgress | None = None,
) -> SearchResult:
    """Search on from the last policy, or from another one if only that gets there.

    A last policy that is expected to come to where it should be, and in time, is improved over the
    whole trial. Otherwise it is searched as `search_beginning_first` does, and the other one too,
    but first over a beginning so short that only the straightest way is worth anything. The other
    one takes its place if it is cheaper over the longer beginning, and is where it should be at its
    end: a policy that is not has nothing to do there, and robots that try it go anywhere. What
    newly stays is searched for as long again: it has learned to come, not yet to stay still.

    Args:
        objective: J(theta) over the whole trial; a sum over its states.
        starts: The last policy, and another one.
        optimiser: As `search_policy`.
        evaluations: Of the search over the whole trial; each one before has half as many.
        progress: Told the best cost of the search under way, and the evaluations of all so far.

    Raises:
        NumericalError: if no finite prediction can be made.
    """
    last, other = starts
    if _stays(objective, last):
        return search_policy(objective, [last], optimiser, evaluations, progress)
    first = total_evaluations(evaluations) - evaluations
    straight = _until(objective, _GETTING_THERE)
    longer = _until(objective, BEGINNING)
    count = 0

    def tell(cost: float, more: int) -> None:
        if progress is not None:
            progress(cost, count + more)

    found = search_policy(straight, [other], optimiser, first, tell)
    count += found.evaluations
    found = search_policy(longer, [found.policy], optimiser, first, tell)
    count += found.evaluations
    own = search_policy(longer, [last], optimiser, first, tell)
    count += own.evaluations
    better = found.cost < own.cost and _is_there(longer, found.policy, longer.horizon)
    chosen = found.policy if better else own.policy
    whole = search_policy(objective, [chosen], optimiser, evaluations, tell)
    count += whole.evaluations
    if _stays(objective, whole.policy):
        whole = search_policy(objective, [whole.policy], optimiser, evaluations, tell)
        count += whole.evaluations
    return dataclasses.replace(whole, evaluations=count)


def _until(objective: Objective, part: float) -> Objective:
    return dataclasses.replace(objective, horizon=math.ceil(part * objective.horizon))


def _stays(objective: Objective, policy: Policy) -> bool:
    """Say whether a policy is where it should be from the end of the longer beginning on."""
    return _is_there(objective, policy, math.ceil(BEGINNING * objective.horizon))


def _is_there(objective: Objective, policy: Policy, first: int) -> bool:
    """Say whether all states from a step on cost much less than the start."""
    trajectory = objective.evaluate(policy, gradient=False).trajectory
    means, covariances = trajectory.means, trajectory.covariances

    def cost_of(step: int) -> float:
        """Return what a state costs: a trajectory of two states costs what the second does."""
        picked = np.array([step, step])
        return objective.cost.evaluate(means[picked], covariances[picked]).value

    dearest = max(cost_of(step) for step in range(first, len(means)))
    return dearest <= _THERE * cost_of(0)
