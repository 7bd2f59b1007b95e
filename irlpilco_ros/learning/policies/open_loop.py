"""A table of controls: what replaying a demonstration does, the baseline of all learning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import REGISTRY, Policy
from irlpilco_ros.learning.policies.declaration import control_limit, number, parameter
from irlpilco_ros.learning.registry import NoSettings
from irlpilco_ros.learning.task import Task


@REGISTRY.register("open_loop")
@dataclass(frozen=True)
class OpenLoopPolicy(Policy):
    """u[t] = table[t], whatever the state; zero after the end of the table.

    Attributes:
        controls: The table, shape (H, F), within the limit.
        control_limit: Largest absolute value of each control, shape (F,).
        state_size: Number of state dimensions D of the robot.
    """

    searchable: ClassVar[bool] = False
    controls: Array = parameter("H F", "Controls of each period, row by row.", "rad/s, or Nm")
    control_limit: Array = control_limit()
    state_size: int = number(
        "Number of state dimensions: positions and velocities of the joints.", minimum=0
    )

    def __post_init__(self) -> None:
        """Check the fields, and the table against the limit."""
        super().__post_init__()
        excess = np.abs(self.controls) - self.control_limit
        if (excess > 1e-9).any():
            step, joint = (int(i) for i in np.unravel_index(excess.argmax(), excess.shape))
            raise InvalidSettingError(
                f"controls of an {self.kind} policy hold {self.controls[step, joint]} at step "
                f"{step}, control {joint}; the limit is {self.control_limit[joint]}"
            )

    @classmethod
    def zero(cls, task: Task, control_limit: Array, settings: NoSettings) -> Self:
        """Return the table of zeros."""
        table = np.zeros((task.horizon, task.control_size))
        return cls(table, control_limit, task.policy_size)

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
