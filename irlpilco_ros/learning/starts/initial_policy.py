"""The policy of the first trial, and the policies that a search may start from."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.squashing import unsquash
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import REGISTRY, OpenLoopPolicy, Policy
from irlpilco_ros.learning.task import Task


def initial_policy(task: Task, settings: LearningSettings) -> Policy:
    """Return the policy of the first trial (thesis Algorithm 3, line 2).

    "demonstration" fits the policy to the demonstration's own speeds: kind to the robot, and the
    data come to lie where they are needed. "random" draws every parameter from
    N(0, initial_scale^2), "random_controls" the controls themselves.
    """
    if settings.initial_policy == "demonstration":
        return fitted_policy(task, settings, task.demonstrated_controls())
    if settings.initial_policy == "random_controls":
        return random_controls(task, settings)
    zero = zero_policy(task, settings)
    if settings.initial_policy == "zero":
        return zero
    return random_policy(zero, settings.seed, settings.initial_scale)


def open_loop_policy(task: Task) -> OpenLoopPolicy:
    """Return the replay of the demonstration's own speeds: the baseline of all learning."""
    controls = np.clip(task.demonstrated_controls(), -task.control_limit, task.control_limit)
    return OpenLoopPolicy(controls, task.control_limit, task.policy_size)


def zero_policy(task: Task, settings: LearningSettings) -> Policy:
    """Return the policy that does nothing, of the kind that is to be learned."""
    kind = REGISTRY.get(settings.policy)
    return kind.zero(task, policy_limit(task, settings), settings.options_of(kind))


def random_policy(policy: Policy, seed: int, scale: float) -> Policy:
    """Return a policy of the same kind with parameters from N(0, scale^2), 1 in the thesis."""
    rng = np.random.default_rng(seed)
    return policy.with_parameters(scale * rng.standard_normal(policy.parameters.shape))


def random_controls(task: Task, settings: LearningSettings) -> OpenLoopPolicy:
    """Return controls drawn evenly from within the limit, as PILCO's first trial has them."""
    limit = policy_limit(task, settings)
    controls = np.random.default_rng(settings.seed).uniform(-1.0, 1.0, (task.horizon, len(limit)))
    return OpenLoopPolicy(controls * limit, limit, task.policy_size)


def policy_limit(task: Task, settings: LearningSettings) -> Array:
    """Return the largest control of the policy, shape (F,) [rad/s].

    A little more than the demonstration needed, never beyond the robot's own limit; just that
    where a demonstration does not tell.
    """
    if not task.tells_controls:
        return task.control_limit
    fastest = np.abs(task.demonstrated_controls()).max(axis=0)
    wanted = settings.velocity_limit_factor * fastest
    limit: Array = np.minimum(np.maximum(wanted, settings.velocity_limit_floor), task.control_limit)
    return limit


def fitted_policy(task: Task, settings: LearningSettings, controls: Array) -> Policy:
    """Return the policy that gives controls (H, F) along the demonstration, as well as it can.

    Raises:
        InvalidSettingError: this kind of policy cannot be fitted.
    """
    zero = zero_policy(task, settings)
    states = task.state_layout.policy_view(task.whole_reference_states()[:-1])
    return _fitted(zero.fit_demonstration(states, unsquash(controls, zero.control_limit)), settings)


def fit_policy(
    task: Task, settings: LearningSettings, steps: Array, states: Array, controls: Array
) -> Policy:
    """Return the policy that gives controls (n, F) at steps (n,) in states (n, D), nearly.

    Raises:
        InvalidSettingError: this kind of policy cannot be fitted.
    """
    zero = zero_policy(task, settings)
    views = task.state_layout.policy_view(states)
    return _fitted(zero.fit(steps, views, unsquash(controls, zero.control_limit)), settings)


def _fitted(policy: Policy | None, settings: LearningSettings) -> Policy:
    if policy is None:
        raise InvalidSettingError(
            f"a {settings.policy} policy cannot be fitted to controls; set initial_policy to zero "
            "or random, and leave inverse out of starts"
        )
    return policy
