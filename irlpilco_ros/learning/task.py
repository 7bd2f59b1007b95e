"""What is to be learned: demonstrations and the few facts about the robot that learning needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import Features, JointPositions
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.prediction.state_layout import StateLayout
from irlpilco_ros.learning.rollout import Rollout


@dataclass(frozen=True)
class Task:
    """Demonstrations to imitate, and the robot that is to do it.

    Attributes:
        demonstrations: One or more, all of the same size; their controls may be all NaN.
        dt: Control period [s].
        control_limit: The robot's own limit of each control, shape (F,) [rad/s].
        features: What is compared; None for the joint positions, the first half of the state.
        feature_scale: Typical size of each feature, in its unit, shape (k,), so that features of
            different units can be weighed against each other; None for ones.
        position_noise: Standard deviation of measured positions [rad].
        velocity_noise: Standard deviation of measured velocities [rad/s].
        layout: What model and policy see of the state; None for all of it as it is.
        start_spread: Known standard deviation of each state at the start of a trial.
    """

    demonstrations: tuple[Rollout, ...]
    dt: float
    control_limit: Array
    features: Features | None = None
    feature_scale: Array | None = None
    position_noise: float = 1e-3
    velocity_noise: float = 1e-2
    layout: StateLayout | None = None
    start_spread: float = 0.0

    def __post_init__(self) -> None:
        demonstrations = tuple(self.demonstrations)
        object.__setattr__(self, "demonstrations", demonstrations)
        if not demonstrations:
            raise InvalidSettingError("a task needs at least one demonstration; got none")
        shapes = {demonstration.states.shape for demonstration in demonstrations}
        if len(shapes) > 1:
            raise InvalidSettingError(
                f"demonstrations have different shapes {sorted(shapes)}; cut them to one length"
            )
        if not (np.isfinite(self.dt) and self.dt > 0.0):
            raise InvalidSettingError(f"dt is {self.dt} s; expected a positive number")
        limit = np.array(self.control_limit, dtype=float)
        object.__setattr__(self, "control_limit", limit)
        if limit.shape != (self.control_size,) or not (limit > 0.0).all():
            raise InvalidSettingError(
                f"control_limit is {limit}; expected {self.control_size} positive numbers"
            )
        if not (self.position_noise > 0.0 and self.velocity_noise > 0.0):
            raise InvalidSettingError(
                f"position_noise is {self.position_noise} rad and velocity_noise "
                f"{self.velocity_noise} rad/s; expected positive numbers"
            )
        if self.features is None:
            object.__setattr__(self, "features", JointPositions(self.state_size // 2))
        if self.layout is None:
            object.__setattr__(self, "layout", StateLayout(self.state_size))
        self._check_scale()

    def _check_scale(self) -> None:
        size = self.feature_map.size
        scale = np.ones(size) if self.feature_scale is None else self.feature_scale
        scale = np.array(scale, dtype=float)
        object.__setattr__(self, "feature_scale", scale)
        if scale.shape != (size,) or not (np.isfinite(scale).all() and (scale > 0.0).all()):
            raise InvalidSettingError(f"feature_scale is {scale}; expected {size} positive numbers")

    @property
    def horizon(self) -> int:
        """Number of control periods H of a demonstration and of every trial."""
        return self.demonstrations[0].steps

    @property
    def state_size(self) -> int:
        """Number of state dimensions D."""
        return int(self.demonstrations[0].states.shape[1])

    @property
    def control_size(self) -> int:
        """Number of controls F."""
        return int(self.demonstrations[0].controls.shape[1])

    @property
    def feature_map(self) -> Features:
        """The features that are compared."""
        assert self.features is not None
        return self.features

    @property
    def scale(self) -> Array:
        """Typical size of each feature, shape (k,)."""
        assert self.feature_scale is not None
        return self.feature_scale

    @property
    def state_layout(self) -> StateLayout:
        """What the model and the policy see of the state."""
        assert self.layout is not None
        return self.layout

    @property
    def noise(self) -> Array:
        """Standard deviation of each measured state [rad, rad/s], shape (D,)."""
        joints = self.state_size // 2
        return np.repeat([self.position_noise, self.velocity_noise], [joints, joints])

    @property
    def policy_size(self) -> int:
        """Number of entries of the state that the policy sees."""
        return int(self.state_layout.policy_view(np.zeros(self.state_size)).shape[0])

    @property
    def tells_controls(self) -> bool:
        """Whether a demonstration tells what to do: by its commands, or by its joints' speeds."""
        commanded = all(run.commanded for run in self.demonstrations)
        return commanded or self.control_size == self.state_size // 2

    def demonstrated_controls(self) -> Array:
        """Return the controls that the demonstration amounts to, shape (H, F).

        What was commanded if somebody commanded the robot, else the speeds of its joints.

        Raises:
            InvalidSettingError: nobody commanded it, and its controls are no speeds of its joints.
        """
        if all(run.commanded for run in self.demonstrations):
            controls: Array = np.mean([run.controls for run in self.demonstrations], axis=0)
            return controls
        if not self.tells_controls:
            raise InvalidSettingError(
                "the demonstration holds no commands, and some joints are not commanded: what the "
                "robot was told cannot be known; choose initial_policy: random or zero"
            )
        positions = self.reference_states()[:, : self.control_size]
        speeds: Array = np.diff(positions, axis=0) / self.dt
        return speeds

    def reference_states(self) -> Array:
        """Return the mean of the demonstrations, shape (H + 1, D)."""
        mean: Array = np.mean([run.states for run in self.demonstrations], axis=0)
        return mean

    def reference_features(self) -> Array:
        """Return phi_E[t], t = 0..H, the mean of the demonstrations' features: (H + 1, k)."""
        features = [self.feature_map.of(run.states) for run in self.demonstrations]
        mean: Array = np.mean(features, axis=0)
        return mean

    def reference_covariances(self) -> Array:
        """Return the demonstrations' spread over the features, never below the noise.

        Returns:
            Shape (H + 1, k, k): the covariance between demonstrations plus the sensor noise as
            the features see it.
        """
        features = np.stack([self.feature_map.of(run.states) for run in self.demonstrations])
        deviations = features - features.mean(axis=0)
        spread: Array = np.einsum("nti,ntj->tij", deviations, deviations) / max(
            1, len(features) - 1
        )
        for t, state in enumerate(self.reference_states()):
            spread[t] += self._noise_at(state)
        return spread

    def feature_noise(self) -> Array:
        """Return the sensor noise as the features see it, on average, shape (k, k)."""
        noise: Array = np.mean([self._noise_at(state) for state in self.reference_states()], axis=0)
        return noise

    def _noise_at(self, state: Array) -> Array:
        moments, _ = self.feature_map.moments(Gaussian(state, np.diag(self.noise**2)))
        floor = (1e-3 * self.scale) ** 2
        noise: Array = moments.covariance + np.diag(floor)
        return noise
