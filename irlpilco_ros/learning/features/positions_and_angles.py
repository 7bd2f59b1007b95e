"""Positions, and sine and cosine of angles: for joints that turn without end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.features.base import Features
from irlpilco_ros.learning.moments.cubature import MeanPullback
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.trigonometric import sine_cosine_moments
from irlpilco_ros.learning.numerics.arrays import Array, symmetric


@dataclass(frozen=True)
class PositionsAndAngles(Features):
    """Positions, and sine and cosine of angles, with exact moments.

    For a cart-pole (x, sin theta, cos theta), as in thesis section 4.

    Attributes:
        positions: Indices of the positions in the state.
        angles: Indices of the angles [rad] in the state.
    """

    positions: tuple[int, ...]
    angles: tuple[int, ...]

    @property
    def units(self) -> tuple[str, ...]:
        """[rad] for each position ([m] where a joint slides), none for the two of each angle."""
        return ("rad",) * len(self.positions) + ("",) * (2 * len(self.angles))

    def of(self, states: Array) -> Array:
        """Return [positions, sin, cos, sin, cos, ...] of states (..., D), shape (..., size)."""
        angles = states[..., list(self.angles)]
        pairs = np.stack([np.sin(angles), np.cos(angles)], axis=-1)
        flat = pairs.reshape(*angles.shape[:-1], 2 * len(self.angles))
        return np.concatenate([states[..., list(self.positions)], flat], axis=-1)

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the exact moments of positions, sines and cosines, also of a stack of states."""
        S = state.covariance
        trig, pull_trig = sine_cosine_moments(state, self.angles)
        count = len(self.positions)
        rows = np.eye(S.shape[-1])[list(self.positions)]
        stacked = np.broadcast_to(rows, (*S.shape[:-2], *rows.shape))
        jacobian = np.concatenate([stacked, trig.jacobian], axis=-2)
        mean = np.concatenate([state.mean @ rows.T, trig.mean], axis=-1)
        covariance = jacobian @ S @ jacobian.swapaxes(-1, -2)
        covariance[..., count:, count:] = trig.covariance

        def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
            # Of trig.jacobian S rows', the covariance between sines and positions.
            cross_bar = covariance_bar[..., count:, :count].copy()
            cross_bar += covariance_bar[..., :count, count:].swapaxes(-1, -2)
            m_bar, S_bar = pull_trig(
                mean_bar[..., count:], covariance_bar[..., count:, count:], cross_bar @ rows @ S
            )
            m_bar = m_bar + mean_bar[..., :count] @ rows
            outer = trig.jacobian.swapaxes(-1, -2) @ cross_bar @ rows
            S_bar = S_bar + rows.T @ covariance_bar[..., :count, :count] @ rows
            return m_bar, S_bar + symmetric(outer)

        return Moments(mean, covariance, jacobian), pullback

    def moments_along(self, states: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the moments of all steps at once."""
        return self.moments(states)
