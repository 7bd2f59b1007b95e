"""The linear policy (thesis (5.7)), squashed: u = squash(W x + b)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.moments.squashing import squash, squashed_moments, squashing_slope
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import REGISTRY, SMALL, Policy
from irlpilco_ros.learning.policies.declaration import control_limit, parameter
from irlpilco_ros.learning.policies.ridge import ridge
from irlpilco_ros.learning.registry import NoSettings
from irlpilco_ros.learning.task import Task

AffinePullback = Callable[[Array, Array, Array], tuple[Array, Array, Array, Array]]


RIDGE = 1e-2
"""Of a fit, relative to the states' own mean square: holds it together with few steps."""


@REGISTRY.register("linear")
@dataclass(frozen=True)
class LinearPolicy(Policy):
    """u = squash(W x + b).

    Attributes:
        weights: W, shape (F, D).
        bias: b, shape (F,).
        control_limit: Largest absolute value of each control, shape (F,).
    """

    weights: Array = parameter(
        "F D", "Gain of each joint's control on each state dimension, row by row."
    )
    bias: Array = parameter("F", "Constant part of each joint's control before squashing.")
    control_limit: Array = control_limit()

    @classmethod
    def zero(cls, task: Task, control_limit: Array, settings: NoSettings) -> Self:
        """Return the policy that does nothing."""
        F = task.control_size
        return cls(np.zeros((F, task.policy_size)), np.zeros(F), control_limit)

    @classmethod
    def random_start(
        cls, task: Task, start: Gaussian, settings: NoSettings, rng: np.random.Generator
    ) -> Self:
        """Return small random gains without a bias."""
        F = task.control_size
        weights = SMALL * rng.standard_normal((F, len(start.mean)))
        return cls(weights, np.zeros(F), task.control_limit)

    def fit(self, steps: Array, states: Array, controls: Array) -> Self:
        """Return the linear policy that gives controls before squashing (n, F), nearly."""
        centre, mean = states.mean(axis=0), controls.mean(axis=0)
        weights = ridge(states - centre, controls - mean, RIDGE).T
        return type(self)(weights, mean - weights @ centre, self.control_limit)

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for a state (D,)."""
        return squash(self.weights @ state + self.bias, self.control_limit)

    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the exact moments of the control at a Gaussian state."""
        moments, pull = affine_moments(self.weights, self.bias, self.control_limit, state)

        def pullback(
            mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
        ) -> tuple[Array, Array, Array]:
            m_bar, S_bar, W_bar, b_bar = pull(mean_bar, covariance_bar, jacobian_bar)
            return m_bar, S_bar, np.concatenate([W_bar.ravel(), b_bar])

        return moments, pullback if gradient else None

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d (mean control) / d parameters, shape (F, p), with the spread held fixed."""
        slope = affine_slope(self.weights, self.bias, self.control_limit, state)
        return np.hstack([each_row(slope, state.mean), np.diag(slope)])

    def spread_curvature(
        self, states: Sequence[Gaussian], steps: Sequence[int], cost_weights: Array
    ) -> Array:
        """Return the Hessian of sum_t tr(cost_weights slope W S W' slope), shape (p, p)."""
        biases = [self.bias] * len(states)
        return affine_curvature(self, self.weights, biases, states, cost_weights)

    def change_metric(self, states: Sequence[Gaussian], steps: Sequence[int]) -> Array:
        """Return the mean square of a change (dW x + db) at Gaussian states, (p, p)."""
        return affine_metric(len(self.bias), states, np.ones((len(states), 1)))


def affine_moments(
    weights: Array, bias: Array, control_limit: Array, state: Gaussian
) -> tuple[Moments, AffinePullback]:
    """Return the moments of squash(W x + b) at x ~ N(m, S), and their pullback.

    The pullback returns the adjoints of m (D,), S (D, D), W (F, D) and b (F,).
    """
    m, S = state.mean, state.covariance
    spread = weights @ S
    raw = Moments(weights @ m + bias, spread @ weights.T, weights)
    moments, pull_squash = squashed_moments(raw, control_limit)

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array, Array, Array]:
        v_bar, V_bar, J_bar = pull_squash(mean_bar, covariance_bar, jacobian_bar)
        weights_bar = np.outer(v_bar, m) + 2.0 * V_bar @ spread + J_bar
        return weights.T @ v_bar, weights.T @ V_bar @ weights, weights_bar, v_bar

    return moments, pullback


def affine_slope(weights: Array, bias: Array, control_limit: Array, state: Gaussian) -> Array:
    """Return the expected slope of the squashing of W x + b, shape (F,)."""
    variance = np.sum((weights @ state.covariance) * weights, axis=1)
    return squashing_slope(weights @ state.mean + bias, variance, control_limit)


def affine_curvature(
    policy: Policy,
    weights: Array,
    biases: Sequence[Array],
    states: Sequence[Gaussian],
    cost_weights: Array,
) -> Array:
    """Return the Hessian of sum_t tr(C slope W S W' slope) by W, the first of the parameters.

    Of one step it is the Kronecker product of 2 C slope slope' (F, F) and S (D, D).

    Args:
        policy: Whose parameters begin with W.
        weights: W, shape (F, D).
        biases: What is added to W x at each step, (F,) each.
        states: At each of T steps.
        cost_weights: C, shape (T, F, F).
    """
    (F, D), T = weights.shape, len(states)
    limit = policy.control_limit
    slopes = np.stack(
        [
            affine_slope(weights, bias, limit, state)
            for bias, state in zip(biases, states, strict=True)
        ]
    )
    weighed = 2.0 * cost_weights * slopes[:, :, None] * slopes[:, None, :]
    spreads = np.stack([state.covariance for state in states])
    blocks = weighed.reshape(T, F * F).T @ spreads.reshape(T, D * D)
    size = len(policy.parameters)
    curvature = np.zeros((size, size))
    by_gains = blocks.reshape(F, F, D, D).swapaxes(1, 2).reshape(F * D, F * D)
    curvature[: F * D, : F * D] = by_gains
    return curvature


def affine_metric(controls: int, states: Sequence[Gaussian], phases: Array) -> Array:
    """Return G (p, p) with d'G d = sum_t E |dW x + dB psi|^2, parameters laid out as W, then B.

    With z = [x, psi] that is sum_t E z z' for each of the controls, F in number.

    Args:
        controls: F.
        states: At each of T steps, of D dimensions.
        phases: psi, shape (T, K).
    """
    inputs = np.hstack([np.stack([state.mean for state in states]), phases])
    D, size = len(states[0].mean), inputs.shape[1]
    second = inputs.T @ inputs
    second[:D, :D] += np.sum([state.covariance for state in states], axis=0)
    parameters = np.arange(controls * size)
    gains, bumps = np.split(parameters, [controls * D])
    own = np.hstack([gains.reshape(controls, D), bumps.reshape(controls, size - D)])
    metric = np.zeros((len(parameters), len(parameters)))
    metric[own[:, :, None], own[:, None, :]] = second
    return metric


def each_row(slope: Array, inputs: Array) -> Array:
    """Return d (slope * (W inputs)) / d W, W row by row: shape (F, F k) for inputs (k,)."""
    size = len(slope)
    rows = np.zeros((size, size, len(inputs)))
    rows[np.arange(size), np.arange(size)] = np.outer(slope, inputs)
    return rows.reshape(size, -1)
