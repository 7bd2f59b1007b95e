"""The trials of a run, found again from their bags by what the robot did."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.rollout import Rollout

# Commands travel as float64 and policies are written with all their digits; what remains is the
# rounding of another BLAS.
SAME_COMMAND = 1e-9  # [rad/s]


@dataclass(frozen=True)
class RecordedTrial:
    """One whole trial of a run.

    Attributes:
        number: Number of its bag.
        path: Its bag.
        rollout: What happened.
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
    read: Callable[[Path], Rollout],
) -> TrialSearch:
    """Find the trials of policies among bags.

    Args:
        bags: Number and path of each bag, in order.
        policies: Policy of each iteration; the first one that fits a trial and has none gets it.
        joints: Joints of the run, in order.
        read: Returns the trial in a bag, or raises BagError.
    """
    found: dict[int, RecordedTrial] = {}
    wrong: dict[Path, BagError] = {}
    for number, path in bags:
        try:
            rollout = read(path)
        except BagError as error:
            wrong[path] = error
            continue
        for iteration, policy in sorted(policies.items()):
            if iteration not in found and ran(policy, rollout, joints):
                found[iteration] = RecordedTrial(number, path, rollout)
                break
    return TrialSearch(found, wrong)


def ran(policy: Policy, rollout: Rollout, joints: Joints) -> bool:
    """Whether a rollout's controls are those of the policy on the rollout's states."""
    if not rollout.commanded or len(policy.control_limit) != rollout.controls.shape[1]:
        return False
    try:
        acting = PolicyOf(joints, policy)
    except InvalidSettingError:  # a policy for other joints
        return False
    return all(
        np.abs(acting.act(state, step) - control).max() <= SAME_COMMAND
        for step, (state, control) in enumerate(
            zip(rollout.states[:-1], rollout.controls, strict=True)
        )
    )
