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
    joints: Joints,
    horizon: int,
) -> dict[int, RecordedTrial]:
    """Return the whole trials by the iteration whose policy ran in them.

    Args:
        bags: Number and path of each bag, in order; those without a whole trial are passed over.
        policies: Policy of each iteration; the first one that fits a trial and has none gets it.
        joints: Joints of the run, in order.
        horizon: Control periods of a trial.
    """
    found: dict[int, RecordedTrial] = {}
    for number, path in bags:
        try:
            rollout = read_bag(path).rollout(joints, horizon)
        except BagError:
            continue
        for iteration, policy in sorted(policies.items()):
            if iteration not in found and ran(policy, rollout, joints):
                found[iteration] = RecordedTrial(number, path, rollout)
                break
    return found


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


def numbered_bags(directory: Path) -> list[tuple[int, Path]]:
    """Return number and path of the bags NNN in a directory, in order.

    Discarded and recovered bags, whose names have a suffix, are left out.
    """
    if not directory.is_dir():
        return []
    bags = (entry for entry in directory.iterdir() if entry.is_dir() and entry.name.isdigit())
    return sorted((bag_number(entry), entry) for entry in bags)
