"""What is known of the next state beside what the dynamics model predicts.

With w = [x, u] and f what the model predicts, the next state is M w + N f; N puts f where it
belongs. M holds what need not be learned: that an increment is added to what was there, and that
commands which are remembered move on by one place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.prediction.model_input import (
    InputPullback,
    ModelInput,
    joint_covariance,
)
from irlpilco_ros.learning.state_layout import StateLayout


@dataclass(frozen=True)
class KnownPart:
    """What is known of the next state, as a linear map of state and control together.

    Attributes:
        matrix: M = [A, B], shape (D, D + F), from `StateLayout.known_part`.
        learned: Which entries of the next state the model's prediction is added to.
        split: Where the control begins in the model's input.
    """

    matrix: Array
    learned: slice
    split: int

    @staticmethod
    def of(layout: StateLayout, controls: int) -> KnownPart:
        """Return it for a robot with this number of controls F."""
        by_state, by_control = layout.known_part
        if not layout.history:
            by_control = np.zeros((len(by_state), controls))
        return KnownPart(
            np.hstack([by_state, by_control]),
            slice(layout.measured_size),
            layout.dynamics_block[1].shape[1],
        )

    def following(self, state: Gaussian, seen: ModelInput, change: Moments) -> Gaussian:
        """Return the next state, given what the model predicts."""
        with_change = self.matrix @ (self.with_input(seen) @ change.jacobian.T)
        mean = self.matrix @ np.concatenate([state.mean, seen.mean[self.split :]])
        covariance = self.matrix @ self._covariance(state, seen) @ self.matrix.T
        mean[self.learned] += change.mean
        covariance[self.learned, self.learned] += change.covariance
        covariance[:, self.learned] += with_change
        covariance[self.learned] += with_change.T
        return Gaussian(mean, symmetric(covariance))

    def with_input(self, seen: ModelInput) -> Array:
        """Return cov(w, input), shape (D + F, P)."""
        return np.concatenate([seen.with_state, seen.covariance[self.split :]])

    def _covariance(self, state: Gaussian, seen: ModelInput) -> Array:
        """Return cov(w), shape (D + F, D + F)."""
        control = seen.covariance[self.split :, self.split :]
        return joint_covariance(state.covariance, seen.with_state[:, self.split :], control)

    def jacobians(self, seen: ModelInput, change_jacobian: Array) -> tuple[Array, Array]:
        """Return the expected Jacobians of the next state by this one and by the control."""
        size = len(self.matrix)
        through_policy = seen.state_jacobian[self.split :]
        by_state = self.matrix[:, :size] + self.matrix[:, size:] @ through_policy
        by_state[self.learned] += change_jacobian @ seen.state_jacobian
        by_control = self.matrix[:, size:].copy()
        by_control[self.learned] += change_jacobian[:, self.split :]
        return by_state, by_control

    def pull(
        self,
        both_bar: tuple[Array, Array],
        input_bar: tuple[Array, Array, Array],
        pull_input: InputPullback,
    ) -> tuple[Array, Array, Array]:
        """Pull derivatives back to the state's mean and covariance and the parameters.

        Args:
            both_bar: By mean (D + F,) and covariance of w.
            input_bar: By mean (P,) and covariance of the model's input, and by cov(w, input).
            pull_input: The pullback of the model's input.
        """
        size, split = len(self.matrix), self.split
        w_bar, w_covariance_bar = both_bar
        mean_bar, covariance_bar, with_input_bar = (bar.copy() for bar in input_bar)
        mean_bar[split:] += w_bar[size:]
        covariance_bar[split:, split:] += w_covariance_bar[size:, size:]
        covariance_bar[split:] += 0.5 * with_input_bar[size:]
        covariance_bar[:, split:] += 0.5 * with_input_bar[size:].T
        with_state_bar = with_input_bar[:size]
        with_state_bar[:, split:] += 2.0 * w_covariance_bar[:size, size:]
        state_bar, state_covariance_bar, parameters_bar = pull_input(
            mean_bar, covariance_bar, with_state_bar
        )
        return (
            state_bar + w_bar[:size],
            state_covariance_bar + w_covariance_bar[:size, :size],
            parameters_bar,
        )
