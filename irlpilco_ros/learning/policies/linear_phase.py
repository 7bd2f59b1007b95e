"""A linear policy with feed-forward over the trial: u = squash(W x + B psi(t)).

A linear policy alone answers the same state with the same control, so that it cannot repeat a
movement that crosses its own path. The moments stay those of the linear policy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.moments.squashing import squash
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import (
    Arrays,
    RegisteredPolicy,
    checked_array,
    checked_limit,
    checked_vector,
    register,
)
from irlpilco_ros.learning.policies.linear import (
    affine_metric,
    affine_moments,
    affine_slope,
    each_row,
)
from irlpilco_ros.learning.settings import setting


@register("linear_phase")
@dataclass(frozen=True)
class LinearPhasePolicy(RegisteredPolicy):
    """u[t] = squash(W x + B psi(t)), psi being Gaussian bumps over the trial that sum to one.

    Attributes:
        weights: W, shape (F, D).
        phase_weights: B, shape (F, K), one column for each bump.
        horizon: Number of control periods over which the bumps are spread.
        control_limit: Largest absolute value of each control, shape (F,).
    """

    @dataclass(frozen=True)
    class Settings:
        """How finely the feed-forward is resolved."""

        count: int = setting(
            16, "Number of feed-forward bumps over the trial.", minimum=1, maximum=1000
        )

    weights: Array
    phase_weights: Array
    horizon: int
    control_limit: Array

    def __post_init__(self) -> None:
        weights = checked_array(self.kind, "weights", self.weights, (None, None))
        object.__setattr__(self, "weights", weights)
        phase = checked_array(self.kind, "phase_weights", self.phase_weights, (len(weights), None))
        object.__setattr__(self, "phase_weights", phase)
        limit = checked_limit(self.kind, self.control_limit, len(weights))
        object.__setattr__(self, "control_limit", limit)
        object.__setattr__(self, "horizon", int(self.horizon))
        if self.horizon < 1 or phase.shape[1] < 1:
            raise InvalidSettingError(
                f"a {self.kind} policy needs a horizon and a number of bumps of at least 1; "
                f"got {self.horizon} and {phase.shape[1]}"
            )

    @property
    def state_size(self) -> int:
        """Number of state dimensions D."""
        return int(self.weights.shape[1])

    @property
    def parameters(self) -> Array:
        """W row by row, then B row by row: shape (F D + F K,)."""
        return np.concatenate([self.weights.ravel(), self.phase_weights.ravel()])

    def with_parameters(self, parameters: Array) -> LinearPhasePolicy:
        """Return the policy with other parameters, laid out as in `parameters`."""
        vector = checked_vector(self, parameters)
        size = self.weights.size
        return LinearPhasePolicy(
            vector[:size].reshape(self.weights.shape),
            vector[size:].reshape(self.phase_weights.shape),
            self.horizon,
            self.control_limit,
        )

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for a state (D,) at a step of the trial."""
        return squash(self.weights @ state + self._feed_forward(step), self.control_limit)

    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the exact moments of the control at a Gaussian state and a step of the trial."""
        phase = phase_features(step, self.phase_weights.shape[1], self.horizon)
        moments, pull = affine_moments(
            self.weights, self.phase_weights @ phase, self.control_limit, state
        )

        def pullback(
            mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
        ) -> tuple[Array, Array, Array]:
            m_bar, S_bar, W_bar, v_bar = pull(mean_bar, covariance_bar, jacobian_bar)
            return m_bar, S_bar, np.concatenate([W_bar.ravel(), np.outer(v_bar, phase).ravel()])

        return moments, pullback if gradient else None

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d (mean control) / d parameters, shape (F, p), with the spread held fixed."""
        bias = self._feed_forward(step)
        slope = affine_slope(self.weights, bias, self.control_limit, state)
        phase = phase_features(step, self.phase_weights.shape[1], self.horizon)
        return np.hstack([each_row(slope, state.mean), each_row(slope, phase)])

    def spread_curvature(self, state: Gaussian, step: int, cost_weight: Array) -> Array:
        """Return the Hessian of tr(cost_weight slope W S W' slope) by the parameters, (p, p)."""
        slope = affine_slope(self.weights, self._feed_forward(step), self.control_limit, state)
        curvature = np.zeros((len(self.parameters), len(self.parameters)))
        size = self.weights.size
        weighed = 2.0 * cost_weight * np.outer(slope, slope)
        curvature[:size, :size] = np.kron(weighed, state.covariance)
        return curvature

    def change_metric(self, state: Gaussian, step: int) -> Array:
        """Return the mean square of a change (dW x + dB psi) at a Gaussian state, (p, p)."""
        phase = phase_features(step, self.phase_weights.shape[1], self.horizon)
        return affine_metric(len(self.weights), state, phase)

    def to_arrays(self) -> Arrays:
        """Return the fields by name."""
        return {
            "weights": self.weights,
            "phase_weights": self.phase_weights,
            "horizon": self.horizon,
            "control_limit": self.control_limit,
        }

    def _feed_forward(self, step: int) -> Array:
        count = self.phase_weights.shape[1]
        feed_forward: Array = self.phase_weights @ phase_features(step, count, self.horizon)
        return feed_forward


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
