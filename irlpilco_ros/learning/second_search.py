"""A search that comes out much worse than before is told, and done again from the best policy."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.search.policy_search import SearchResult

MUCH_WORSE = 5.0
"""Times the predicted cost of before. With new data and weights it also grows where all is well,
but by a factor of two at the most."""

_NEGLIGIBLE = 0.01
"""Of what the best trial did cost: a prediction below that is well, however little was predicted
before. Feature expectations, for one, can be met to the last digit."""


def search_twice_if_needed(
    search: Callable[[Sequence[Policy]], SearchResult],
    starts: Sequence[Policy],
    previous: Iteration | None,
    best: Iteration | None,
    achieved: Callable[[int], float],
) -> tuple[SearchResult, tuple[str, ...]]:
    """Search from the starts, and from the best policy if that predicts much worse than before.

    Args:
        search: Searches from starts.
        starts: Where it starts.
        previous: The iteration before; None if it learned nothing.
        best: The iteration whose trial was the best so far; None for the one before.
        achieved: Returns what the trial of an iteration did cost.

    Returns:
        Of both searches what costs less, with the evaluations of both, and what is to be told.

    Raises:
        NumericalError: if no finite prediction can be made.
    """
    found = search(starts)
    before = _cheapest(previous, best)
    if before is None or found.cost <= MUCH_WORSE * before.cost:
        return found, ()
    resort = best if best is not None and best.policy.searchable else before
    if found.cost <= _NEGLIGIBLE * achieved(resort.index):
        return found, ()
    note = (
        f"the predicted cost {found.cost:.4g} was {found.cost / before.cost:.0f} times the "
        f"{before.cost:.4g} of iteration {before.index}; searched again from the policy of "
        f"iteration {resort.index}: "
    )
    try:
        again = search([resort.policy])
    except NumericalError as error:
        return found, (f"{note}{error}",)
    chosen = again if again.cost < found.cost else found
    note += f"{again.cost:.4g}"
    if chosen.cost > MUCH_WORSE * before.cost:
        note += "; expect a bad trial, and give the search more evaluations"
    return dataclasses.replace(chosen, evaluations=found.evaluations + again.evaluations), (note,)


def _cheapest(*iterations: Iteration | None) -> Iteration | None:
    """Return the iteration of the least predicted cost, of those whose costs can be multiplied."""
    known = [each for each in iterations if each is not None and each.cost > 0.0]
    return min(known, key=lambda each: each.cost, default=None)
