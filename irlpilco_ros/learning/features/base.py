"""What every way of comparing motions can do, and how a robot's settings file chooses one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.moments.cubature import MeanPullback
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.registry import Extension, Registry


class Features(Extension, ABC):
    """A map phi from states to features, for samples and for Gaussian states."""

    @property
    @abstractmethod
    def units(self) -> tuple[str, ...]:
        """SI unit of each feature, such as "rad"; "" for one that has none."""

    @abstractmethod
    def of(self, states: Array) -> Array:
        """Return the features (..., k) of states (..., D)."""

    @abstractmethod
    def moments(self, state: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the features' moments at a Gaussian state, and their pullback."""

    def moments_along(self, states: Gaussian) -> tuple[Moments, MeanPullback]:
        """Return the features' moments at the states of a trajectory, and their pullback.

        Arrays are those of `moments`, stacked along a first axis for the steps. Features whose
        `moments` takes such stacks as well have it do all steps at once.

        Args:
            states: Means (H + 1, D) and covariances (H + 1, D, D).
        """
        steps = [
            self.moments(Gaussian(mean, covariance))
            for mean, covariance in zip(states.mean, states.covariance, strict=True)
        ]
        arrays = zip(*((m.mean, m.covariance, m.jacobian) for m, _ in steps), strict=True)

        def pullback(means_bar: Array, covariances_bar: Array) -> tuple[Array, Array]:
            bars = [
                pull(mean_bar, covariance_bar)
                for (_, pull), mean_bar, covariance_bar in zip(
                    steps, means_bar, covariances_bar, strict=True
                )
            ]
            return np.stack([bar[0] for bar in bars]), np.stack([bar[1] for bar in bars])

        return Moments(*(np.stack(each) for each in arrays)), pullback

    @classmethod
    def of_robot(cls, joints: Joints, settings: Any) -> Features:
        """Return the features of a robot with these joints; needed to be chosen by name.

        Args:
            joints: The robot's joints.
            settings: An instance of `cls.Settings`.

        Raises:
            InvalidSettingError: they do not fit the robot.
        """
        raise NotImplementedError(f"{cls.__name__} cannot be chosen by name: it lacks of_robot")

    @classmethod
    def of_tools(cls, joints: Joints, settings: Any, tools: Callable[[], Any]) -> Features:
        """Return the features of a robot with these joints and tools; most need no tools.

        Args:
            joints: As for `of_robot`, like settings and errors.
            settings: Likewise.
            tools: Returns what is known of its tools (`tool_points.ComparedTools`), or raises if
                too little is.
        """
        return cls.of_robot(joints, settings)

    def where_moved(self, move: Array) -> Features:
        """Return the features where the object is now; those of joints do not see it.

        Args:
            move: The rigid motion of the object since it was shown, in the base frame, (4, 4).
        """
        return self

    @property
    def size(self) -> int:
        """Number of features k."""
        return len(self.units)


REGISTRY: Registry[Features] = Registry(
    "irlpilco_ros.features",
    Features,  # type: ignore[type-abstract]
)
"""What `features` of a robot's settings may be."""


def select_moments(state: Gaussian, size: int) -> tuple[Moments, MeanPullback]:
    """Return the moments of the first entries of a state, or of a stack of states."""
    shape = state.covariance.shape

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
        m_bar, S_bar = np.zeros(shape[:-1]), np.zeros(shape)
        m_bar[..., :size] = mean_bar
        S_bar[..., :size, :size] = covariance_bar
        return m_bar, S_bar

    jacobian = np.broadcast_to(np.eye(size, shape[-1]), (*shape[:-2], size, shape[-1]))
    return Moments(state.mean[..., :size], state.covariance[..., :size, :size], jacobian), pullback
