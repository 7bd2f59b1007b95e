"""The policy of the first trial, and the policies that a search may start from."""

from __future__ import annotations

from typing import Any

import numpy as np

from irlpilco_ros.learning.gp.kernel import squared_exponential
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.squashing import unsquash
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import (
    LinearPhasePolicy,
    LinearPolicy,
    OpenLoopPolicy,
    Policy,
    RbfPolicy,
)
from irlpilco_ros.learning.policies.linear_phase import phase_features
from irlpilco_ros.learning.policies.rbf import RIDGE
from irlpilco_ros.learning.task import Task

_BUMP_RIDGE = 1e-4  # of the bumps' mean square: bumps that overlap share the work
_RIDGE = 1e-2  # of the states' own mean square: holds fits with fewer steps than states together


def initial_policy(task: Task, settings: LearningSettings) -> Policy:
    """Return the policy of the first trial (thesis Algorithm 3, line 2).

    "demonstration" fits the policy to the demonstration's own speeds: kind to the robot, and the
    data come to lie where they are needed. "random" draws every parameter from N(0, 1),
    "random_controls" the controls themselves.
    """
    if settings.initial_policy == "demonstration":
        return fitted_policy(task, settings, task.demonstrated_controls())
    if settings.initial_policy == "random_controls":
        return random_controls(task, settings)
    zero = zero_policy(task, settings)
    return zero if settings.initial_policy == "zero" else random_policy(zero, settings.seed)


def open_loop_policy(task: Task) -> OpenLoopPolicy:
    """Return the replay of the demonstration's own speeds: the baseline of all learning."""
    controls = np.clip(task.demonstrated_controls(), -task.control_limit, task.control_limit)
    return OpenLoopPolicy(controls, task.control_limit, task.state_size)


def zero_policy(task: Task, settings: LearningSettings) -> Policy:
    """Return the policy that does nothing, of the kind that is to be learned."""
    limit = policy_limit(task, settings)
    F = task.control_size
    weights = np.zeros((F, task.policy_size))
    if settings.policy == "linear":
        return LinearPolicy(weights, np.zeros(F), limit)
    if settings.policy == "rbf":
        return _rbf_policy(task, settings, np.zeros((_count(RbfPolicy, settings), F)), limit)
    phases = np.zeros((F, _count(LinearPhasePolicy, settings)))
    return LinearPhasePolicy(weights, phases, task.horizon, limit)


def random_policy(policy: Policy, seed: int) -> Policy:
    """Return a policy of the same kind with parameters from N(0, 1) (the thesis)."""
    rng = np.random.default_rng(seed)
    return policy.with_parameters(rng.standard_normal(policy.parameters.shape))


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
    """Return the policy that gives controls (H, F) along the demonstration, as well as it can."""
    zero = zero_policy(task, settings)
    wanted = unsquash(controls, zero.control_limit)
    states = task.state_layout.policy_view(task.reference_states()[:-1])
    if isinstance(zero, LinearPhasePolicy):
        steps = range(task.horizon)
        phases = np.stack(
            [phase_features(t, _count(LinearPhasePolicy, settings), task.horizon) for t in steps]
        )
        bumps = _ridge(phases, wanted, 1e-6).T
        return LinearPhasePolicy(zero.weights, bumps, task.horizon, zero.control_limit)
    if isinstance(zero, RbfPolicy):
        nearest = _spread_steps(task, settings)
        return _rbf_policy(task, settings, wanted[nearest], zero.control_limit)
    centre = states.mean(axis=0)
    weights = _ridge(states - centre, wanted - wanted.mean(axis=0), _RIDGE).T
    return LinearPolicy(weights, wanted.mean(axis=0) - weights @ centre, zero.control_limit)


def fit_policy(
    task: Task, settings: LearningSettings, steps: Array, states: Array, controls: Array
) -> Policy:
    """Return the policy that gives controls (n, F) at steps (n,) in states (n, D), nearly."""
    zero = zero_policy(task, settings)
    wanted = unsquash(controls, zero.control_limit)
    views = task.state_layout.policy_view(states)
    if isinstance(zero, RbfPolicy):
        widths = np.exp(zero.log_widths)
        bumps = squared_exponential(views, zero.centres, widths[0], 1.0)
        own = squared_exponential(zero.centres, zero.centres, widths[0], 1.0)
        heights = _ridge(bumps, wanted, _BUMP_RIDGE)
        targets = (own + RIDGE * np.eye(len(own))) @ heights
        return RbfPolicy(zero.centres, targets, zero.log_widths, zero.control_limit)
    if isinstance(zero, LinearPhasePolicy):
        phases = [
            phase_features(int(t), _count(LinearPhasePolicy, settings), task.horizon) for t in steps
        ]
        both = _ridge(np.hstack([views, np.stack(phases)]), wanted, _BUMP_RIDGE).T
        weights, bumps = both[:, : views.shape[1]], both[:, views.shape[1] :]
        return LinearPhasePolicy(weights, bumps, task.horizon, zero.control_limit)
    centre = views.mean(axis=0)
    weights = _ridge(views - centre, wanted - wanted.mean(axis=0), _RIDGE).T
    return LinearPolicy(weights, wanted.mean(axis=0) - weights @ centre, zero.control_limit)


def _rbf_policy(task: Task, settings: LearningSettings, targets: Array, limit: Array) -> RbfPolicy:
    """Return bumps along the demonstration, as wide as it is long in each dimension."""
    states = task.state_layout.policy_view(task.reference_states())
    widths = np.maximum(states.std(axis=0), 1e-2) * np.sqrt(states.shape[1])
    return RbfPolicy(states[_spread_steps(task, settings)], targets, np.log(widths)[None], limit)


def _spread_steps(task: Task, settings: LearningSettings) -> Array:
    """Return as many steps as there are bumps, evenly over the trial."""
    steps: Array = np.round(np.linspace(0, task.horizon - 1, _count(RbfPolicy, settings))).astype(
        int
    )
    return steps


def _count(kind: type[Any], settings: LearningSettings) -> int:
    return int(settings.options_of(kind).count)


def _ridge(inputs: Array, targets: Array, ridge: float) -> Array:
    """Return the coefficients (k, F) of a ridge regression, the ridge relative to the inputs."""
    gram: Array = inputs.T @ inputs
    gram += ridge * max(float(np.trace(gram)), 1e-12) / len(gram) * np.eye(len(gram))
    return np.asarray(np.linalg.solve(gram, inputs.T @ targets), dtype=np.float64)
