"""The end of a pass: what is predicted of the policy that was found, and how far to trust that."""

from __future__ import annotations

from collections.abc import Sequence

from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.measured_band import measured_deviations
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.search.policy_search import SearchResult
from irlpilco_ros.learning.task import Task


def concluded(
    task: Task,
    trials: Sequence[Rollout],
    objective: Objective,
    found: SearchResult,
    weighed: tuple[Array, float],
    previous: Iteration | None,
) -> Iteration:
    """Return the iteration of a policy that was found, but for its model, times and notes.

    Args:
        task: What it is for.
        trials: Every trial so far.
        objective: What was searched in.
        found: The policy.
        weighed: Cost weights (k,) and margin.
        previous: The iteration before; None if there was none that learned.
    """
    prediction = objective.evaluate(found.policy, gradient=False).trajectory
    measured = task.state_size
    covariances = prediction.covariances[:, :measured, :measured]
    weights, margin = weighed
    return Iteration(
        index=len(trials),
        policy=found.policy,
        weights=weights,
        margin=margin,
        cost=found.cost,
        predicted_means=prediction.means[:, :measured],
        predicted_covariances=covariances,
        predicted_deviations=measured_deviations(task, covariances, previous, trials),
        evaluations=found.evaluations,
    )
