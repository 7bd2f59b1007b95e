"""A curriculum of growing horizons: follow the demonstration as far as the model can predict it.

Over a whole trial, imitation step by step has optima that no search leaves: a swing-up to the wrong
side ends upright as well. And where the model has no data, the cost of the rest of the trial,
about the same for every policy, outweighs the beginning. So the horizon grows in stages, as long as
the prediction follows the demonstration; the next trial goes a little further than that, and brings
data from there.
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
from irlpilco_ros.learning.search.optimisers import SearchProgress
from irlpilco_ros.learning.search.policy_search import SearchResult, search_policy

_SHORTEST = 4  # steps: fewer say next to nothing about a policy
_DIVERGED = 0.25  # of the features' weighted variance along the demonstration, in one step


@dataclasses.dataclass(frozen=True)
class HorizonCurriculum:
    """Policy search over growing horizons.

    Attributes:
        objective: J(theta) over the whole horizon.
        cost: Its cost.
        optimiser: As `search_policy`.
        stages: In how many the horizon grows.
        screening_evaluations: Of the first start at each stage, and of the others in screening.
        evaluations: Of each search of the start that wins screening.
    """

    objective: Objective
    cost: StepwiseCost
    optimiser: str
    stages: int
    screening_evaluations: int
    evaluations: int

    def search(
        self, starts: Sequence[Policy], progress: SearchProgress | None = None
    ) -> SearchResult:
        """Return the policy that follows longest, and best, and its cost over the whole horizon.

        The first start is searched stage by stage until its prediction diverges from the
        demonstration. All starts are screened at that horizon; the one that follows longest is
        improved there, and then stage by stage for as long as it follows.

        Args:
            starts: The most promising one first; the others are screened as they are.
            progress: Told the best cost of a stage, and all evaluations so far.

        Raises:
            NumericalError: if no finite prediction can be made.
        """
        counter = _Counter(progress)
        first, horizon = self._grow_until_diverged(starts[0], counter)
        ends = [
            self._improve(start, horizon, self.screening_evaluations, counter)
            for start in (first, *starts[1:])
        ]
        best = min(ends, key=lambda end: self.cost_without_recovery(end, horizon))
        best = self._grow_while_followed(best, horizon, counter)
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

    def followed_horizon(self, policy: Policy) -> int:
        """Return the end of the stage in which the prediction diverges, or the whole horizon.

        It diverges from the demonstration in a step that cannot be predicted, or that costs more
        than a fraction of what standing still at the mean of the demonstration's features would.
        """
        allowed = _DIVERGED * self.cost.standing_still()
        for horizon in self.horizons[:-1]:
            try:
                if self._steps(policy, horizon).max() > allowed:
                    return horizon
            except NumericalError:
                return horizon
        return self.horizons[-1]

    def cost_without_recovery(self, policy: Policy, horizon: int) -> float:
        """Return the cost if every step costs at least as much as each step before it.

        A policy that leaves the demonstration gains nothing by coming back to it.
        """
        return float(np.maximum.accumulate(self._steps(policy, horizon)).sum())

    def _grow_until_diverged(self, policy: Policy, counter: _Counter) -> tuple[Policy, int]:
        """Return the policy after the stage in which its prediction diverges, and that horizon."""
        for horizon in self.horizons[:-1]:
            policy = self._improve(policy, horizon, self.screening_evaluations, counter)
            if self.followed_horizon(policy) <= horizon:
                return policy, horizon
        return policy, self.horizons[-1]

    def _grow_while_followed(self, policy: Policy, horizon: int, counter: _Counter) -> Policy:
        """Return the policy improved at a horizon, and further for as long as it follows."""
        searched, followed = 0, max(horizon, self.followed_horizon(policy))
        while followed > searched:
            searched = followed
            policy = self._improve(policy, searched, self.evaluations, counter)
            followed = self.followed_horizon(policy)
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
