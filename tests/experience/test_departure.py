"""A trial is known by its commands, also where they were brought within an acceleration limit."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.control.acceleration_limit import AccelerationLimit
from irlpilco_ros.experience.trials import NEARLY_SAME_COMMAND, SAME_COMMAND, departure
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import OpenLoopPolicy
from irlpilco_ros.learning.rollout import Rollout, mean_command

JOINTS = Joints(("a", "b"))
LIMITS, PERIOD, STATES = np.array([5.0, 2.0]), 0.25, 25


def trial_of(table: np.ndarray) -> Rollout:
    """Decisions that are held, as they go out within the limit, a hundred a second."""
    limit, sent = AccelerationLimit(LIMITS), []
    for tick, decision in enumerate(table):
        stamps = (round(1e7) * (STATES * tick + state) for state in range(STATES))
        sent.append(mean_command(np.array([limit.limited(stamp, decision) for stamp in stamps])))
    return Rollout(np.zeros((len(table) + 1, 4)), np.array(sent))


@pytest.mark.parametrize("size", [0.1, 0.9])
def test_a_held_policy_is_known_by_what_its_limit_left_of_it(size):
    rng = np.random.default_rng(3)
    table = size * rng.uniform(-1.0, 1.0, (12, 2))
    policy = OpenLoopPolicy(table, 2.0 * np.ones(2), 12)
    other = OpenLoopPolicy(table + 0.2 * size, 2.0 * np.ones(2), 12)
    trial, reach = trial_of(table), LIMITS * PERIOD
    assert departure(policy, trial, JOINTS, reach) <= NEARLY_SAME_COMMAND
    if size > 0.5:
        assert departure(other, trial, JOINTS, reach) == np.inf
        assert departure(policy, trial, JOINTS) == np.inf, "its own decisions were not sent"


def test_without_a_limit_every_bit_counts():
    table = np.full((4, 2), 0.3)
    policy = OpenLoopPolicy(table, np.ones(2), 4)
    assert departure(policy, Rollout(np.zeros((5, 4)), table), JOINTS) == 0.0
    assert departure(policy, Rollout(np.zeros((5, 4)), table + 2 * SAME_COMMAND), JOINTS) == np.inf
