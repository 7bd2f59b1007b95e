"""What a demonstration is compared by: features of the state, with exact or cubature moments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from irlpilco_ros.learning.cubature import MeanPullback, cubature_moments
from irlpilco_ros.learning.gaussian import Array, Gaussian, Moments
from irlpilco_ros.learning.trigonometric import sine_cosine_moments


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
class PositionAndAngle:
    """(x, sin theta, cos theta) of a cart-pole (thesis section 5), with exact moments.

    Attributes:
        position: Index of the cart's position [m] in the state.
        angle: Index of the pole's angle [rad] in the state.
    """

    position: int
    angle: int

    @property
    def size(self) -> int:
        """Three features."""
        return 3

    def of(self, states: Array) -> Array:
        """Return (x, sin theta, cos theta) of states (..., D), shape (..., 3)."""
        angle = states[..., self.angle]
        return np.stack([states[..., self.position], np.sin(angle), np.cos(angle)], axis=-1)

    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the exact moments of (x, sin theta, cos theta)."""
        S = state.covariance
        trig, pull_trig = sine_cosine_moments(state, [self.angle])
        row = np.eye(1, len(state.mean), self.position)
        jacobian = np.vstack([row, trig.jacobian])
        mean = np.concatenate([state.mean[[self.position]], trig.mean])
        covariance = jacobian @ S @ jacobian.T
        covariance[1:, 1:] = trig.covariance

        def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
            cross_bar = covariance_bar[1:, :1] + covariance_bar[:1, 1:].T  # of trig.jacobian S row'
            trig_bar = cross_bar @ (row @ S)
            m_bar, S_bar = pull_trig(mean_bar[1:], covariance_bar[1:, 1:], trig_bar)
            m_bar = m_bar + mean_bar[0] * row[0]
            outer = trig.jacobian.T @ cross_bar @ row
            S_bar = S_bar + covariance_bar[0, 0] * row.T @ row + 0.5 * (outer + outer.T)
            return m_bar, S_bar

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
