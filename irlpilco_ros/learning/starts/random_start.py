"""The policy that PILCO's first search starts from."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.policies import REGISTRY, Policy
from irlpilco_ros.learning.prediction.model_input import extended_state
from irlpilco_ros.learning.task import Task


def random_start(
    task: Task, settings: LearningSettings, states: Gaussian, number: int = 0
) -> Policy:
    """Return the policy that the first search starts from, as PILCO draws it.

    Args:
        task: What is to be learned.
        settings: How.
        states: Where the parts of the policy lie; with PILCO those in which trials start.
        number: Each gives another policy.
    """
    kind = REGISTRY.get(settings.policy)
    extended, _ = extended_state(states, task.state_layout)
    viewed = list(task.state_layout.policy_inputs or ())
    seen = Gaussian(extended.mean[viewed], extended.covariance[np.ix_(viewed, viewed)])
    # A last number of 0 is as good as none.
    rng = np.random.default_rng([settings.seed + 1, number])
    return kind.random_start(task, seen, settings.options_of(kind), rng)
