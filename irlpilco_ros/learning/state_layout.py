"""Which parts of a state the dynamics model and the policy see, and in which form.

A robot that lags answers to what it was told before. The whole state of such a robot is what is
measured of it and its last commands, which nobody has to predict: they are known.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class StateLayout:
    """Index lists into the extended state [x, sin and cos of each angle] (as in PILCO).

    For a robot arm the defaults are right: the model and the policy see the whole state.

    Attributes:
        state_size: Number of dimensions D of the whole state, remembered commands included.
        angles: Indices of the states whose sine and cosine are wanted.
        dynamics_inputs: Indices into the extended state that the dynamics model sees.
        policy_inputs: Indices into the extended state that the policy sees.
        differences: Indices of the states whose increments the model predicts; of the others it
            predicts the next value itself.
        controls: Number of controls F of a command that is remembered; 0 if none is.
        history: Number of commands h that are remembered: the last h F dimensions of the state are
            u[k-1], u[k-2], ..., u[k-h], the latest first.
    """

    state_size: int
    angles: tuple[int, ...] = ()
    dynamics_inputs: tuple[int, ...] | None = None
    policy_inputs: tuple[int, ...] | None = None
    differences: tuple[int, ...] | None = None
    controls: int = 0
    history: int = 0

    def __post_init__(self) -> None:
        measured = self.measured_size
        if self.history < 0 or measured < 1:
            raise InvalidSettingError(
                f"a state of {self.state_size} dimensions cannot hold {self.history} commands of "
                f"{self.controls} controls"
            )
        extended = self.state_size + 2 * len(self.angles)
        for name, whole, size in (
            ("angles", measured, measured),
            ("dynamics_inputs", self.state_size, extended),
            ("policy_inputs", self.state_size, extended),
            ("differences", measured, measured),
        ):
            value = getattr(self, name)
            indices = tuple(range(whole) if value is None else (int(i) for i in value))
            object.__setattr__(self, name, indices)
            if len(set(indices)) != len(indices) or any(not 0 <= i < size for i in indices):
                raise InvalidSettingError(
                    f"{name} are {indices}; expected different indices from 0 to {size - 1}"
                )

    @property
    def measured_size(self) -> int:
        """Number of dimensions of what is measured of the state."""
        return self.state_size - self.controls * self.history

    def remembering(self, controls: int, history: int) -> Self:
        """Return the layout in which the last commands are part of the state as well.

        Args:
            controls: Number of controls F.
            history: How many commands are remembered; 0 for the layout without any.

        Raises:
            InvalidSettingError: this layout remembers some already.
        """
        if self.history:
            raise InvalidSettingError(f"this state holds {self.history} commands already")
        if not history:
            return self
        first, added = self.state_size, controls * history
        remembered = tuple(range(first, first + added))

        def shifted(indices: tuple[int, ...] | None) -> tuple[int, ...]:
            seen = tuple(i + added if i >= first else i for i in indices or ())
            return tuple(sorted(seen + remembered))

        return dataclasses.replace(
            self,
            state_size=first + added,
            dynamics_inputs=shifted(self.dynamics_inputs),
            policy_inputs=shifted(self.policy_inputs),
            controls=controls,
            history=history,
        )

    def whole_states(self, states: Array, controls: Array) -> Array:
        """Return the whole states of a run that began at rest, shape (T + 1, D).

        Args:
            states: What was measured, shape (T + 1, `measured_size`).
            controls: What was commanded, shape (T, F).
        """
        before = np.zeros((self.history, self.controls))
        told = np.concatenate([before, controls]) if self.history else before
        steps = len(states)
        last = [told[self.history - lag :][:steps] for lag in range(1, self.history + 1)]
        return np.concatenate([states, *last], axis=1)

    def extend(self, states: Array) -> Array:
        """Return [x, sin x_i, cos x_i, ...] for states (..., D), shape (..., D + 2A)."""
        parts = [states]
        for angle in self.angles:
            parts += [np.sin(states[..., angle, None]), np.cos(states[..., angle, None])]
        return np.concatenate(parts, axis=-1)

    def policy_view(self, states: Array) -> Array:
        """Return what the policy sees of states (..., D)."""
        view: Array = self.extend(states)[..., list(self.policy_inputs or ())]
        return view

    def policy_noise(self, noise: Array) -> Array:
        """Return the variance of the sensors' noise in what the policy sees, shape (V,).

        Remembered commands have none; sine and cosine of an angle at most that of the angle.

        Args:
            noise: Standard deviation of each measured state, shape (`measured_size`,).
        """
        known = np.zeros(self.controls * self.history)
        angles = np.repeat(noise[list(self.angles)], 2)
        variances: Array = np.concatenate([noise, known, angles]) ** 2
        return variances[list(self.policy_inputs or ())]

    def dynamics_view(self, states: Array) -> Array:
        """Return what the dynamics model sees of states (..., D)."""
        view: Array = self.extend(states)[..., list(self.dynamics_inputs or ())]
        return view

    def targets(self, states: Array) -> Array:
        """Return what the dynamics model predicts, for measured states (T + 1, E): (T, E)."""
        return states[1:] - states[:-1] * self.difference_mask

    @cached_property
    def difference_mask(self) -> Array:
        """1 where the model predicts an increment, 0 where the next value, shape (E,)."""
        mask = np.zeros(self.measured_size)
        mask[list(self.differences or ())] = 1.0
        mask.flags.writeable = False
        return mask

    @cached_property
    def known_part(self) -> tuple[Array, Array]:
        """A (D, D) and B (D, F) of the next state A x + B u + [f(x, u), 0], f being learned.

        What is measured stays where it was where f is its increment; a command becomes the last
        one, and that the one before.
        """
        measured, size, controls = self.measured_size, self.state_size, self.controls
        by_state, by_control = np.zeros((size, size)), np.zeros((size, controls))
        by_state[range(measured), range(measured)] = self.difference_mask
        if self.history:
            by_control[measured : measured + controls] = np.eye(controls)
            by_state[measured + controls :, measured : size - controls] = np.eye(
                size - measured - controls
            )
        return by_state, by_control

    @cached_property
    def dynamics_block(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of what the dynamics model sees, in the extended state's covariance."""
        rows, columns = np.ix_(self.dynamics_inputs or (), self.dynamics_inputs or ())
        return rows, columns

    @cached_property
    def policy_block(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of what the policy sees, in the extended state's covariance."""
        rows, columns = np.ix_(self.policy_inputs or (), self.policy_inputs or ())
        return rows, columns
