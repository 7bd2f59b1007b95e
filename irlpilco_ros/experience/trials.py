"""The trials of a run, found again from their bags by what the robot did."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout

# Commands travel as float64 and policies are written with all their digits; what remains is the
# rounding of another BLAS.
SAME_COMMAND = 1e-9  # [rad/s]

# Of a decision that is blended in, the mean of what was sent is known, at the robot's own rate and
# within its acceleration limit.
NEARLY_SAME_COMMAND = 0.05  # [rad/s]


@dataclass(frozen=True)
class RecordedTrial:
    """One whole trial of a run.

    Attributes:
        number: Number of its bag.
        path: Its bag.
        rollout: What is learned from it.
    """

    number: int
    path: Path
    rollout: Rollout


@dataclass(frozen=True)
class TrialSearch:
    """What was found among the bags of a run.

    Attributes:
        trials: The whole trials by the iteration whose policy ran in them.
        wrong: What is wrong with each bag that holds no whole trial.
    """

    trials: dict[int, RecordedTrial]
    wrong: dict[Path, BagError]


def find_trials(
    bags: Iterable[tuple[int, Path]],
    policies: Mapping[int, Policy],
    joints: Joints,
    read: Callable[[Path], tuple[Rollout, Rollout]],
    reach: Array | None = None,
) -> TrialSearch:
    """Find the trials of policies among bags.

    Args:
        bags: Number and path of each bag, in order.
        policies: Policy of each iteration; the one that fits a trial best and has none gets it.
        joints: Joints of the run, in order.
        read: Returns the trial in a bag, as the policy saw it and as it is learned from, or raises
            BagError.
        reach: See `departure`.
    """
    found: dict[int, RecordedTrial] = {}
    wrong: dict[Path, BagError] = {}
    for number, path in bags:
        try:
            seen, rollout = read(path)
        except BagError as error:
            wrong[path] = error
            continue
        free = {k: policy for k, policy in sorted(policies.items()) if k not in found}
        off = {k: departure(policy, seen, joints, reach) for k, policy in free.items()}
        fitting = [k for k in free if off[k] <= _tolerance(free[k], reach)]
        if fitting:
            found[min(fitting, key=off.__getitem__)] = RecordedTrial(number, path, rollout)
    return TrialSearch(found, wrong)


def merged(searches: Sequence[TrialSearch]) -> TrialSearch:
    """Return what several searches of the same bags found; a bag is wrong that is so in all."""
    first, *others = searches
    trials = {k: trial for search in searches for k, trial in search.trials.items()}
    wrong = {
        bag: error
        for bag, error in first.wrong.items()
        if all(bag in other.wrong for other in others)
    }
    return TrialSearch(trials, wrong)


def departure(
    policy: Policy, rollout: Rollout, joints: Joints, reach: Array | None = None
) -> float:
    """Return by how much a rollout's controls differ from the policy's at most [rad/s].

    Infinite if it is no policy for these joints, or nobody commanded them.

    Args:
        policy: What may have acted.
        rollout: What was done.
        joints: Joints of the run, in order.
        reach: By how much each command may change in a control period (F,) [rad/s]; None for any.
    """
    if not rollout.commanded or len(policy.control_limit) != rollout.controls.shape[1]:
        return math.inf
    try:
        acting = PolicyOf(joints, policy)
    except InvalidSettingError:  # a policy for other joints
        return math.inf
    largest = 0.0
    tolerance = _tolerance(policy, reach)
    sent = np.zeros(rollout.controls.shape[1])
    for step, (state, control) in enumerate(
        zip(rollout.states[:-1], rollout.controls, strict=True)
    ):
        expected = acting.act(state, step)
        if reach is not None and not policy.blend:
            expected, sent = _brought_within(expected, sent, reach)
        largest = max(largest, float(np.abs(expected - control).max()))
        if largest > tolerance:
            return math.inf
    return largest


def _brought_within(wanted: Array, before: Array, reach: Array) -> tuple[Array, Array]:
    """Return mean and end of a period's commands that go from `before` to `wanted` steadily."""
    change = np.clip(wanted - before, -reach, reach)
    end = before + change
    return end - 0.5 * change * np.abs(change) / reach, end


def _tolerance(policy: Policy, reach: Array | None) -> float:
    return SAME_COMMAND if reach is None and not policy.blend else NEARLY_SAME_COMMAND
