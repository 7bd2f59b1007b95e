"""Policy search for a given cost with a second start: the first may lead nowhere, or astray."""

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
_CLEARLY = 0.9  # of what a policy costs that stays: worth another one that was never tried
_NOTHING = 0.95  # of what staying at the start costs: what costs more gains nothing


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
    """Search on from the last policy, or from another one if that gets there, and better.

    Each is searched over the beginning of a trial first, as `search_beginning_first` does; the
    other one, before that, over a beginning so short that only the straightest way is worth
    anything. A last policy that is expected to come to where it should be, in time, and to stay
    has no need of that, but may have come by a detour: the other one is tried against it all the
    same, and has to be clearly cheaper.

    The other one takes its place if it is cheaper over the longer beginning, and is where it should
    be at its end: a policy that is not has nothing to do there, and robots that try it go anywhere.
    That is still better than a last one that is not expected to gain anything over staying where
    trials start: it would do so for ever, for such trials teach nothing. What newly stays is
    searched for as long again: it has learned to come, not yet to stay still.

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
    searches = _Searches(optimiser, progress)
    first = total_evaluations(evaluations) - evaluations
    longer = _until(objective, BEGINNING)
    straight = searches.run(_until(objective, _GETTING_THERE), other, first)
    found = searches.run(longer, straight.policy, first)
    stays = _stays(objective, last)
    own = last if stays else searches.run(longer, last, first).policy
    limit = longer.evaluate(own, gradient=False).value * (_CLEARLY if stays else 1.0)
    worthy = _is_there(longer, found.policy, longer.horizon) or _gains_nothing(longer, own)
    is_new = found.cost < limit and worthy
    whole = searches.run(objective, found.policy if is_new else own, evaluations)
    if (is_new or not stays) and _stays(objective, whole.policy):
        whole = searches.run(objective, whole.policy, evaluations)
    return dataclasses.replace(whole, evaluations=searches.evaluations)


class _Searches:
    """Searches one after the other.

    Attributes:
        evaluations: Of all of them so far.
    """

    def __init__(self, optimiser: str, progress: SearchProgress | None) -> None:
        self.evaluations = 0
        self._optimiser = optimiser
        self._progress = progress

    def run(self, objective: Objective, policy: Policy, evaluations: int) -> SearchResult:
        """Search on from a policy."""
        found = search_policy(objective, [policy], self._optimiser, evaluations, self._tell)
        self.evaluations += found.evaluations
        return found

    def _tell(self, cost: float, more: int) -> None:
        if self._progress is not None:
            self._progress(cost, self.evaluations + more)


def _until(objective: Objective, part: float) -> Objective:
    return dataclasses.replace(objective, horizon=math.ceil(part * objective.horizon))


def _stays(objective: Objective, policy: Policy) -> bool:
    """Say whether a policy is where it should be from the end of the longer beginning on."""
    return _is_there(objective, policy, math.ceil(BEGINNING * objective.horizon))


def _is_there(objective: Objective, policy: Policy, first: int) -> bool:
    """Say whether all states from a step on cost much less than the start."""
    costs = _costs(objective, policy)
    return max(costs[first:]) <= _THERE * costs[0]


def _gains_nothing(objective: Objective, policy: Policy) -> bool:
    """Say whether a policy is expected to cost as much as staying where trials start."""
    costs = _costs(objective, policy)
    return sum(costs[1:]) > _NOTHING * costs[0] * objective.horizon


def _costs(objective: Objective, policy: Policy) -> list[float]:
    """Return what each state of a policy's trajectory is expected to cost, the start's first."""
    trajectory = objective.evaluate(policy, gradient=False).trajectory
    means, covariances = trajectory.means, trajectory.covariances

    def cost_of(step: int) -> float:  # a trajectory of two states costs what the second does
        picked = np.array([step, step])
        return objective.cost.evaluate(means[picked], covariances[picked]).value

    return [cost_of(step) for step in range(len(means))]
