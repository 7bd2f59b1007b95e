"""Following a demonstration as far as the model knows the way, then further.

Over a whole trial, imitation step by step has optima that no search leaves: a swing-up to the wrong
side ends upright as well. And where the model knows nothing, the cost of the rest of the trial,
about the same for every policy, outweighs the beginning. So the horizon grows in stages, as long as
the prediction stays with the demonstration; the trial that follows goes a little further than that,
and brings data from there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from irlpilco_ros.learning.costs import StepwiseCost
from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.search.policy_search import SearchProgress, SearchResult, search_policy

_SHORTEST = 4  # steps: fewer say next to nothing about a policy
_LOST = 0.25  # of the features' weighted variance along the demonstration, in one step


@dataclasses.dataclass(frozen=True)
class StagedSearch:
    """Policy search over growing horizons.

    Attributes:
        objective: J(theta) over the whole horizon.
        cost: Its cost.
        optimiser: As `search_policy`.
        stages: In how many the horizon grows.
        tries: Evaluations of each start at each stage, and in screening.
        evaluations: Of each search of the start that wins screening.
    """

    objective: Objective
    cost: StepwiseCost
    optimiser: str
    stages: int
    tries: int
    evaluations: int

    def search(
        self, starts: Sequence[Policy], progress: SearchProgress | None = None
    ) -> SearchResult:
        """Return the policy that follows longest, and best, and its cost over the whole horizon.

        The first start is led from stage to stage until the demonstration is lost. At that
        horizon all starts are screened; who stays with the demonstration longest goes on, as far as
        the demonstration is followed and one stage further.

        Args:
            starts: The first is one that is worth leading; the others are screened as they are.
            progress: Told the best cost of a stage, and all evaluations so far.

        Raises:
            NumericalError: if no finite prediction can be made.
        """
        counter = _Counter(progress)
        led, horizon = self._lead(starts[0], counter)
        ends = [self._improve(start, horizon, self.tries, counter) for start in (led, *starts[1:])]
        best = min(ends, key=lambda end: self.lasting_cost(end, horizon))
        best = self._go_on(best, horizon, counter)
        cost = self.objective.evaluate(best, gradient=False).value
        return SearchResult(best, cost, counter.before)

    @cached_property
    def horizons(self) -> tuple[int, ...]:
        """The stages' ends; the last one is the whole horizon."""
        whole = self.objective.horizon
        ends = (round(whole * stage / self.stages) for stage in range(1, self.stages))
        return (*(end for end in ends if end >= _SHORTEST), whole)

    def until(self, horizon: int) -> Objective:
        """Return the objective over the first steps alone."""
        return dataclasses.replace(self.objective, horizon=horizon, cost=self.cost.until(horizon))

    def reach(self, policy: Policy) -> int:
        """Return the end of the stage in which the demonstration is lost, or the whole horizon.

        It is lost in a step that costs more than a part of what standing still at the mean of the
        demonstration's features would cost, or that cannot be predicted.
        """
        allowed = _LOST * self.cost.standing_still()
        for horizon in self.horizons[:-1]:
            try:
                if self._steps(policy, horizon).max() > allowed:
                    return horizon
            except NumericalError:
                return horizon
        return self.horizons[-1]

    def lasting_cost(self, policy: Policy, horizon: int) -> float:
        """Return the cost with every step as dear as the dearest before it.

        Who leaves the demonstration gains nothing by finding back to it.
        """
        return float(np.maximum.accumulate(self._steps(policy, horizon)).sum())

    def _lead(self, policy: Policy, counter: _Counter) -> tuple[Policy, int]:
        """Return the policy led to where it loses the demonstration, and that horizon."""
        for horizon in self.horizons[:-1]:
            policy = self._improve(policy, horizon, self.tries, counter)
            if self.reach(policy) <= horizon:
                return policy, horizon
        return policy, self.horizons[-1]

    def _go_on(self, policy: Policy, horizon: int, counter: _Counter) -> Policy:
        """Return the policy improved at a horizon, and further for as long as it reaches."""
        searched, reach = 0, max(horizon, self.reach(policy))
        while reach > searched:
            searched = reach
            policy = self._improve(policy, searched, self.evaluations, counter)
            reach = self.reach(policy)
        return policy

    def _improve(self, policy: Policy, horizon: int, evaluations: int, counter: _Counter) -> Policy:
        found = search_policy(
            self.until(horizon), [policy], self.optimiser, evaluations, counter.tell
        )
        counter.before += found.evaluations
        return found.policy

    def _steps(self, policy: Policy, horizon: int) -> Array:
        objective = self.until(horizon)
        trajectory = objective.evaluate(policy, gradient=False).trajectory
        return self.cost.until(horizon).steps(trajectory.means, trajectory.covariances)


class _Counter:
    """Counts evaluations over several searches, and tells about them."""

    def __init__(self, progress: SearchProgress | None) -> None:
        self._progress = progress
        self.before = 0

    def tell(self, cost: float, evaluations: int) -> None:
        if self._progress is not None:
            self._progress(cost, self.before + evaluations)
