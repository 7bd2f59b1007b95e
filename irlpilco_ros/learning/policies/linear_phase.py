"""A linear policy with feed-forward over the trial: u = squash(W x + B psi(t)).

A linear policy alone answers the same state with the same control, so that it cannot repeat a
movement that crosses its own path. The moments stay those of the linear policy.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.moments.squashing import squash
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import REGISTRY, Policy
from irlpilco_ros.learning.policies.declaration import control_limit, number, parameter
from irlpilco_ros.learning.policies.linear import (
    affine_curvature,
    affine_metric,
    affine_moments,
    affine_slope,
    each_row,
)
from irlpilco_ros.learning.policies.ridge import BUMP_RIDGE, ridge
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.learning.task import Task

_FEED_FORWARD_RIDGE = 1e-6  # relative to the bumps' mean square


@REGISTRY.register("linear_phase")
@dataclass(frozen=True)
class LinearPhasePolicy(Policy):
    """u[t] = squash(W x + B psi(t)), psi being Gaussian bumps over the trial that sum to one.

    Attributes:
        weights: W, shape (F, D).
        phase_weights: B, shape (F, K), one column for each bump.
        horizon: Number of control periods over which the bumps are spread.
        control_limit: Largest absolute value of each control, shape (F,).
    """

    @dataclass(frozen=True)
    class Settings:
        """How fine the feed-forward is."""

        count: int = setting(
            16,
            "Number of bumps over the trial that the feed-forward is made of: more follow faster "
            "changes and take more parameters.",
            minimum=1,
            maximum=1000,
        )

        def __post_init__(self) -> None:
            check(self)

    weights: Array = parameter(
        "F D", "Gain of each joint's control on each state dimension, row by row."
    )
    phase_weights: Array = parameter(
        "F K", "Feed-forward of each joint on each phase feature, row by row."
    )
    horizon: int = number(
        "Number of control periods over which the phase features are spread.", minimum=1
    )
    control_limit: Array = control_limit()

    @classmethod
    def zero(cls, task: Task, control_limit: Array, settings: Settings) -> Self:
        """Return the policy that does nothing."""
        F = task.control_size
        phases = np.zeros((F, settings.count))
        return cls(np.zeros((F, task.policy_size)), phases, task.horizon, control_limit)

    def fit_demonstration(self, states: Array, controls: Array) -> Self:
        """Return the feed-forward that gives controls before squashing (H, F), nearly."""
        bumps = ridge(self._phases(range(len(states))), controls, _FEED_FORWARD_RIDGE).T
        return dataclasses.replace(self, phase_weights=bumps)

    def fit(self, steps: Array, states: Array, controls: Array) -> Self:
        """Return gains and feed-forward that give controls before squashing (n, F), nearly."""
        seen = np.stack([self._seen(x, int(t)) for x, t in zip(states, steps, strict=True)])
        both = ridge(np.hstack([seen, self._phases(steps)]), controls, BUMP_RIDGE).T
        split = states.shape[1]
        return dataclasses.replace(self, weights=both[:, :split], phase_weights=both[:, split:])

    def along(self, states: Array, controls: Array, control_limit: Array) -> Self:
        """Return the policy with the same gains W dx, dx being measured from other states.

        Arguments are those of `Policy.along`. Gains are in units of the limit.
        """
        weights = self.weights * (self.control_limit / control_limit)[:, None]
        same = dataclasses.replace(
            self, weights=weights, control_limit=control_limit, horizon=len(states)
        )
        seen = np.stack([same._seen(state, step) for step, state in enumerate(states)])
        return same.fit_demonstration(states, controls - seen @ weights.T)

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for a state (D,) at a step of the trial."""
        feedback = self.weights @ self._seen(state, step)
        return squash(feedback + self._feed_forward(step), self.control_limit)

    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the exact moments of the control at a Gaussian state and a step of the trial."""
        phase = self._phase(step)
        moments, pull = affine_moments(
            self.weights, self.phase_weights @ phase, self.control_limit, self._off(state, step)
        )

        def pullback(
            mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
        ) -> tuple[Array, Array, Array]:
            m_bar, S_bar, W_bar, v_bar = pull(mean_bar, covariance_bar, jacobian_bar)
            return m_bar, S_bar, np.concatenate([W_bar.ravel(), np.outer(v_bar, phase).ravel()])

        return moments, pullback if gradient else None

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d (mean control) / d parameters, shape (F, p), with the spread held fixed."""
        bias, seen = self._feed_forward(step), self._off(state, step)
        slope = affine_slope(self.weights, bias, self.control_limit, seen)
        phase = self._phase(step)
        return np.hstack([each_row(slope, seen.mean), each_row(slope, phase)])

    def spread_curvature(
        self, states: Sequence[Gaussian], steps: Sequence[int], cost_weights: Array
    ) -> Array:
        """Return the Hessian of sum_t tr(cost_weights slope W S W' slope), shape (p, p)."""
        biases = [self._feed_forward(step) for step in steps]
        seen = [self._off(state, step) for state, step in zip(states, steps, strict=True)]
        return affine_curvature(self, self.weights, biases, seen, cost_weights)

    def change_metric(self, states: Sequence[Gaussian], steps: Sequence[int]) -> Array:
        """Return the mean square of a change (dW x + dB psi) at Gaussian states, (p, p)."""
        seen = [self._off(state, step) for state, step in zip(states, steps, strict=True)]
        return affine_metric(len(self.weights), seen, self._phases(steps))

    def _seen(self, state: Array, step: int) -> Array:
        """Return what gains act on, for a state (D,) at a step of the trial."""
        return state

    def _off(self, state: Gaussian, step: int) -> Gaussian:
        """Return the same for a Gaussian state."""
        return Gaussian(self._seen(state.mean, step), state.covariance)

    def _feed_forward(self, step: int) -> Array:
        feed_forward: Array = self.phase_weights @ self._phase(step)
        return feed_forward

    def _phase(self, step: int) -> Array:
        """Return psi(t) of a step, shape (K,)."""
        return phase_features(step, self.phase_weights.shape[1], self.horizon)

    def _phases(self, steps: Iterable[Any]) -> Array:
        """Return psi(t) of steps (n,), shape (n, K)."""
        return np.stack([self._phase(int(t)) for t in steps])


def phase_features(step: int, count: int, horizon: int) -> Array:
    """Return psi(t), shape (count,): Gaussian bumps as wide as their spacing, summing to one.

    Args:
        step: Step t of the trial; the last step's value is kept after the end.
        count: Number of bumps, spread evenly from the first step to the last.
        horizon: Number of steps of the trial.
    """
    if count == 1 or horizon == 1:
        return np.full(count, 1.0 / count)
    last = horizon - 1
    distance = min(step, last) * (count - 1) / last - np.arange(count)
    bumps = np.exp(-0.5 * distance**2)
    normalised: Array = bumps / bumps.sum()
    return normalised
