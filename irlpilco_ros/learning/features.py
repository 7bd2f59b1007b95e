"""What a demonstration is compared by: features of the state, with exact or cubature moments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from irlpilco_ros.learning.moments.cubature import MeanPullback, cubature_moments
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.trigonometric import sine_cosine_moments
from irlpilco_ros.learning.numerics.arrays import Array


class Features(Protocol):
    """A map from states to features, for samples and for Gaussian beliefs."""

    @property
    def size(self) -> int:
        """Number of features."""

    def of(self, states: Array) -> Array:
        """Return the features (..., size) of states (..., D)."""

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the features' moments at a Gaussian state, and their pullback."""


@dataclass(frozen=True)
class JointPositions:
    """The first J entries of the state: joint positions [rad] (thesis section 6).

    Attributes:
        size: Number of joints J.
    """

    size: int

    def of(self, states: Array) -> Array:
        """Return the joint positions (..., J) of states (..., D)."""
        return states[..., : self.size]

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the moments of the joint positions."""
        return select_moments(state, self.size)


def select_moments(state: Gaussian, size: int) -> tuple[Moments, MeanPullback]:
    """Return the moments of the first entries of a state, and their pullback."""
    whole = len(state.mean)

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
        m_bar, S_bar = np.zeros(whole), np.zeros((whole, whole))
        m_bar[:size] = mean_bar
        S_bar[:size, :size] = covariance_bar
        return m_bar, S_bar

    return Moments(state.mean[:size], state.covariance[:size, :size], np.eye(size, whole)), pullback


@dataclass(frozen=True)
class PositionsAndAngles:
    """Positions, and sine and cosine of angles, with exact moments.

    For a cart-pole (x, sin theta, cos theta), as in thesis section 4.

    Attributes:
        positions: Indices of the positions in the state.
        angles: Indices of the angles [rad] in the state.
    """

    positions: tuple[int, ...]
    angles: tuple[int, ...]

    @property
    def size(self) -> int:
        """One feature for each position, two for each angle."""
        return len(self.positions) + 2 * len(self.angles)

    def of(self, states: Array) -> Array:
        """Return [positions, sin, cos, sin, cos, ...] of states (..., D), shape (..., size)."""
        angles = states[..., list(self.angles)]
        pairs = np.stack([np.sin(angles), np.cos(angles)], axis=-1)
        flat = pairs.reshape(*angles.shape[:-1], 2 * len(self.angles))
        return np.concatenate([states[..., list(self.positions)], flat], axis=-1)

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the exact moments of positions, sines and cosines."""
        S = state.covariance
        trig, pull_trig = sine_cosine_moments(state, self.angles)
        count = len(self.positions)
        rows = np.eye(len(state.mean))[list(self.positions)]
        jacobian = np.vstack([rows, trig.jacobian])
        mean = np.concatenate([rows @ state.mean, trig.mean])
        covariance = jacobian @ S @ jacobian.T
        covariance[count:, count:] = trig.covariance

        def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
            # Of trig.jacobian S rows', the covariance between sines and positions.
            cross_bar = covariance_bar[count:, :count] + covariance_bar[:count, count:].T
            m_bar, S_bar = pull_trig(
                mean_bar[count:], covariance_bar[count:, count:], cross_bar @ rows @ S
            )
            m_bar = m_bar + rows.T @ mean_bar[:count]
            outer = trig.jacobian.T @ cross_bar @ rows
            S_bar = S_bar + rows.T @ covariance_bar[:count, :count] @ rows
            return m_bar, S_bar + 0.5 * (outer + outer.T)

        return Moments(mean, covariance, jacobian), pullback


@dataclass(frozen=True)
class CubatureFeatures:
    """Any smooth function of the first J entries of the state, such as hand positions [m].

    Attributes:
        size: Number of features.
        inputs: Number J of leading state entries that the function takes.
        function: Maps points (m, J) to features (m, size) and their Jacobians (m, size, J).
    """

    size: int
    inputs: int
    function: Callable[[Array], tuple[Array, Array]]

    def of(self, states: Array) -> Array:
        """Return the features (..., size) of states (..., D)."""
        points = states[..., : self.inputs]
        values, _ = self.function(points.reshape(-1, self.inputs))
        return values.reshape(*states.shape[:-1], self.size)

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the features' moments by spherical cubature."""
        joints, pull_joints = select_moments(state, self.inputs)
        moments, pull = cubature_moments(self.function, Gaussian(joints.mean, joints.covariance))
        padding = np.zeros((self.size, len(state.mean) - self.inputs))

        def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
            return pull_joints(*pull(mean_bar, covariance_bar))

        return Moments(
            moments.mean, moments.covariance, np.hstack([moments.jacobian, padding])
        ), pullback
