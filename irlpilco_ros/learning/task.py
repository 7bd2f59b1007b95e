"""What is to be learned: demonstrations or a cost, and the few facts about the robot."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from irlpilco_ros.learning.costs import Cost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import Features, JointPositions
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.state_layout import StateLayout


@dataclass(frozen=True)
class Task:
    """Demonstrations to imitate, or a cost to keep low, and the robot that is to do it.

    Attributes:
        demonstrations: All of the same size; their controls may be all NaN. None where a cost is
            given.
        dt: Control period [s].
        control_limit: The robot's own limit of each control, shape (F,) [rad/s].
        features: What is compared; None for the joint positions, the first half of the state.
        feature_scale: Typical size of features by their unit, such as {"rad": 1.0, "m": 0.3}, so
            that features of different units can be weighed against each other; 1 where none is
            given.
        position_noise: Standard deviation of measured positions [rad].
        velocity_noise: Standard deviation of measured velocities [rad/s].
        layout: What model and policy see of the state; None for all of it as it is. Needed with a
            cost.
        start_spread: Known standard deviation of each state at the start of a trial.
        cost: What a predicted trajectory costs (PILCO); None to imitate.
        start: State at the start of a trial, where it is known; None for where trials did start.
        region: Where the state may go in a trial, roughly, whole state: with a cost that is a sum
            over states, policy search may then also start from policies that act all over it;
            None if that is not told.
        horizon: Number of control periods H of every trial; 0 for that of the demonstrations.
        speed: How many times as fast the demonstrations are as they were shown: of two tasks that
            are the same motion, it tells which moment of one is which of the other.

    Raises:
        InvalidSettingError: something is missing, out of its range or of another size.
    """

    demonstrations: tuple[Rollout, ...]
    dt: float
    control_limit: Array
    features: Features | None = None
    feature_scale: Mapping[str, float] = field(default_factory=dict)
    position_noise: float = 1e-3
    velocity_noise: float = 1e-2
    layout: StateLayout | None = None
    start_spread: float = 0.0
    cost: Cost | None = None
    start: Gaussian | None = None
    region: Gaussian | None = None
    horizon: int = 0
    speed: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "demonstrations", tuple(self.demonstrations))
        if self.demonstrations:
            self._take_demonstrations()
        elif self.cost is None:
            raise InvalidSettingError("a task needs at least one demonstration or a cost; got none")
        if self.layout is None or self.horizon < 1:
            raise InvalidSettingError(
                f"a task without demonstrations needs a layout and a horizon of at least 1; got "
                f"{self.layout} and {self.horizon}"
            )
        if self.features is None:
            object.__setattr__(self, "features", JointPositions(self.state_size // 2))
        if not (np.isfinite(self.dt) and self.dt > 0.0):
            raise InvalidSettingError(f"dt is {self.dt} s; expected a positive number")
        if not (np.isfinite(self.speed) and self.speed > 0.0):
            raise InvalidSettingError(f"speed is {self.speed}; expected a positive number")
        self._check_limit()
        if not (self.position_noise > 0.0 and self.velocity_noise > 0.0):
            raise InvalidSettingError(
                f"position_noise is {self.position_noise} rad and velocity_noise "
                f"{self.velocity_noise} rad/s; expected positive numbers"
            )
        self._check_scale()

    def _take_demonstrations(self) -> None:
        """Check the demonstrations, and take from them what was not given."""
        shapes = {demonstration.states.shape for demonstration in self.demonstrations}
        if len(shapes) > 1:
            raise InvalidSettingError(
                f"demonstrations have different shapes {sorted(shapes)}; cut them to one length"
            )
        steps, size = self.demonstrations[0].steps, self.demonstrations[0].states.shape[1]
        if self.horizon not in (0, steps):
            raise InvalidSettingError(
                f"the horizon is {self.horizon}, but demonstrations have {steps} steps; leave it "
                "out, or cut them to that length"
            )
        object.__setattr__(self, "horizon", steps)
        if self.layout is None:
            object.__setattr__(self, "layout", StateLayout(size))
        if self.state_size != size:
            raise InvalidSettingError(
                f"the layout is of {self.state_size} states; the demonstrations have {size}"
            )

    def _check_limit(self) -> None:
        limit = np.array(self.control_limit, dtype=float)
        object.__setattr__(self, "control_limit", limit)
        shown = self.demonstrations[0].controls.shape[1:] if self.demonstrations else limit.shape
        if limit.shape != shown or limit.ndim != 1 or not (limit > 0.0).all():
            raise InvalidSettingError(
                f"control_limit is {limit}; expected a positive number for each of the controls"
                + (f", {shown[0]} numbers" if self.demonstrations else "")
            )

    def _check_scale(self) -> None:
        units = set(self.feature_map.units)
        for unit, size in self.feature_scale.items():
            if unit not in units or not (np.isfinite(size) and size > 0.0):
                raise InvalidSettingError(
                    f"feature_scale is {dict(self.feature_scale)}; expected positive numbers for "
                    f"units of the features: {', '.join(sorted(units))}"
                )

    @property
    def state_size(self) -> int:
        """Number of dimensions of what is measured of the state."""
        return self.state_layout.measured_size

    @property
    def control_size(self) -> int:
        """Number of controls F."""
        return len(self.control_limit)

    @property
    def feature_map(self) -> Features:
        """The features that are compared."""
        assert self.features is not None
        return self.features

    @property
    def scale(self) -> Array:
        """Typical size of each feature, shape (k,)."""
        return np.array([self.feature_scale.get(unit, 1.0) for unit in self.feature_map.units])

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
        return len(self.state_layout.policy_inputs or ())

    def remembering(self, history: int) -> Task:
        """Return the task of a robot whose state holds so many of its last commands, too."""
        layout = self.state_layout.remembering(self.control_size, history)
        return dataclasses.replace(self, layout=layout)

    @property
    def tells_controls(self) -> bool:
        """Whether a demonstration tells what to do: by its commands, or by its joints' speeds."""
        if not self.demonstrations:
            return False
        commanded = all(run.commanded for run in self.demonstrations)
        return commanded or self.control_size == self.state_size // 2

    def demonstrated_controls(self) -> Array:
        """Return the controls that the demonstration amounts to, shape (H, F).

        What was commanded if somebody commanded the robot, else the speeds of its joints.

        Raises:
            InvalidSettingError: nobody commanded it, and its controls are no speeds of its joints.
        """
        if not self.demonstrations:
            raise InvalidSettingError(
                "the task has a cost but no demonstration to take controls from; choose "
                "initial_policy: random_controls, random or zero"
            )
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

    def whole_reference_states(self) -> Array:
        """Return the mean of the demonstrations with remembered commands, shape (H + 1, D).

        They are what the demonstration amounts to.
        """
        states, layout = self.reference_states(), self.state_layout
        controls = self.demonstrated_controls() if layout.history else np.empty((0, 0))
        return layout.whole_states(states, controls)

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
