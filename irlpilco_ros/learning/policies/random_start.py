"""The policy that PILCO's first search starts from."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.policies import LinearPolicy, Policy, RbfPolicy
from irlpilco_ros.learning.prediction.model_input import extended_state
from irlpilco_ros.learning.task import Task


def random_start(task: Task, settings: LearningSettings, start: Gaussian) -> Policy:
    """Return the policy that the first search starts from, as PILCO draws it.

    Bumps of width one lie where trials start, with small random heights.

    Args:
        task: What is to be learned.
        settings: How.
        start: State at the start of a trial.

    Raises:
        InvalidSettingError: if the policy kind is neither "rbf" nor "linear".
    """
    rng = np.random.default_rng(settings.seed + 1)
    F = len(task.control_limit)
    extended, _ = extended_state(start, task.state_layout)
    viewed = list(task.state_layout.policy_inputs or ())
    if settings.policy == "linear":
        weights = 0.1 * rng.standard_normal((F, len(viewed)))
        return LinearPolicy(weights, np.zeros(F), task.control_limit)
    if settings.policy != "rbf":
        raise InvalidSettingError(
            f"policy is {settings.policy!r}; classical PILCO learns one of: rbf, linear"
        )
    spread = extended.covariance[np.ix_(viewed, viewed)]
    count = settings.options_of(RbfPolicy).count
    centres = rng.multivariate_normal(extended.mean[viewed], spread, count, method="eigh")
    targets = 0.1 * rng.standard_normal((count, F))
    return RbfPolicy(centres, targets, np.zeros((F, len(viewed))), task.control_limit)
