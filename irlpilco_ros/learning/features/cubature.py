"""Features that are any smooth function of the joint positions, with moments by cubature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.features.base import Features, select_moments
from irlpilco_ros.learning.moments.cubature import MeanPullback, cubature_moments
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class CubatureFeatures(Features):
    """A smooth function of the first J entries of the state, such as hand positions [m].

    Attributes:
        inputs: Number J of leading state entries that the function takes.
        function: Maps points (m, J) to features (m, k) and their Jacobians (m, k, J).
        feature_units: SI unit of each of the k features.
    """

    inputs: int
    function: Callable[[Array], tuple[Array, Array]]
    feature_units: tuple[str, ...]

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each feature."""
        return self.feature_units

    def of(self, states: Array) -> Array:
        """Return the features (..., k) of states (..., D)."""
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
