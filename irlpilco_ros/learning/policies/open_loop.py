"""A table of controls: what replaying a demonstration does, the baseline of all learning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import (
    Arrays,
    RegisteredPolicy,
    checked_array,
    checked_limit,
    checked_vector,
    register,
)


@register("open_loop")
@dataclass(frozen=True)
class OpenLoopPolicy(RegisteredPolicy):
    """u[t] = table[t], whatever the state; zero after the end of the table.

    Attributes:
        controls: The table, shape (H, F), within the limit.
        control_limit: Largest absolute value of each control, shape (F,).
        state_size: Number of state dimensions D of the robot.
    """

    is_searchable: ClassVar[bool] = False
    controls: Array
    control_limit: Array
    state_size: int

    def __post_init__(self) -> None:
        controls = checked_array(self.kind, "controls", self.controls, (None, None))
        object.__setattr__(self, "controls", controls)
        limit = checked_limit(self.kind, self.control_limit, controls.shape[1])
        object.__setattr__(self, "control_limit", limit)
        object.__setattr__(self, "state_size", int(self.state_size))
        excess = np.abs(controls) - limit
        if (excess > 1e-9).any():
            step, joint = (int(i) for i in np.unravel_index(excess.argmax(), excess.shape))
            raise InvalidSettingError(
                f"controls of an {self.kind} policy hold {controls[step, joint]} at step {step}, "
                f"control {joint}; the limit is {limit[joint]}"
            )

    @property
    def parameters(self) -> Array:
        """The table row by row, shape (H F,)."""
        return self.controls.ravel()

    def with_parameters(self, parameters: Array) -> OpenLoopPolicy:
        """Return the policy with another table."""
        vector = checked_vector(self, parameters)
        return OpenLoopPolicy(
            vector.reshape(self.controls.shape), self.control_limit, self.state_size
        )

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) of a step, whatever the state."""
        if step >= len(self.controls):
            return np.zeros_like(self.control_limit)
        control: Array = self.controls[step].copy()
        return control

    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the control of a step, which has no spread."""
        size, state_size = len(self.control_limit), len(state.mean)
        moments = Moments(
            self.act(state.mean, step), np.zeros((size, size)), np.zeros((size, state_size))
        )

        def pullback(
            mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
        ) -> tuple[Array, Array, Array]:
            parameters_bar = np.zeros_like(self.controls)
            if step < len(self.controls):
                parameters_bar[step] = mean_bar
            zeros = np.zeros((state_size, state_size))
            return np.zeros(state_size), zeros, parameters_bar.ravel()

        return moments, pullback if gradient else None

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d control / d table, shape (F, H F): ones where the step's row is."""
        size = self.controls.shape[1]
        return np.eye(size, self.controls.size, step * size)

    def spread_curvature(self, state: Gaussian, step: int, cost_weight: Array) -> Array | None:
        """Return None: a table has no gains."""
        return None

    def change_metric(self, state: Gaussian, step: int) -> Array | None:
        """Return None: every control is a parameter of its own."""
        return None

    def to_arrays(self) -> Arrays:
        """Return the fields by name."""
        return {
            "controls": self.controls,
            "control_limit": self.control_limit,
            "state_size": self.state_size,
        }
