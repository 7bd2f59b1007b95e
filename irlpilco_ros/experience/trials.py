"""The trials of a run, found again from their bags by what the robot did."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_files import bag_number
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.learning.joints import Joints
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


def find_trials(
    bags: Iterable[tuple[int, Path]],
    policies: Mapping[int, Policy],
    read: Callable[[Path], Rollout],
) -> tuple[dict[int, RecordedTrial], dict[Path, BagError]]:
    """Return the whole trials by the iteration whose policy ran in them.

    Args:
        bags: Number and path of each bag, in order.
        policies: Policy of each iteration; the first one that fits a trial and has none gets it.
        read: Returns the trial in a bag, or raises BagError.

    Returns:
        The trials, and what is wrong with the bags that hold no whole one.
    """
    found: dict[int, RecordedTrial] = {}
    wrong: dict[Path, BagError] = {}
    for number, path in bags:
        try:
            rollout = read(path)
        except BagError as error:
            wrong[path] = error
            continue
        for iteration, (policy, joints) in sorted(policies.items()):
            if iteration not in found and ran(policy, rollout, joints):
                found[iteration] = RecordedTrial(number, path, rollout)
                break
    return found, wrong


def ran(policy: Policy, rollout: Rollout, joints: Joints) -> bool:
    """Whether a rollout's controls are those of the policy on the rollout's states."""
    if not rollout.commanded or len(policy.control_limit) != rollout.controls.shape[1]:
        return False
    return all(
        np.abs(joints.act(policy, state, step) - control).max() <= SAME_COMMAND
        for step, (state, control) in enumerate(
            zip(rollout.states[:-1], rollout.controls, strict=True)
        )
    )
