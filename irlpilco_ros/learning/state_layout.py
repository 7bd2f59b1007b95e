"""Which parts of a state the dynamics model and the policy see, and in which form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class StateLayout:
    """Index lists into the extended state [x, sin and cos of each angle] (as in PILCO).

    For a robot arm the defaults are right: the model and the policy see the whole state.

    Attributes:
        state_size: Number of state dimensions D.
        angles: Indices of the states whose sine and cosine are wanted.
        dynamics_inputs: Indices into the extended state that the dynamics model sees.
        policy_inputs: Indices into the extended state that the policy sees.
        differences: Indices of the states whose increments the model predicts; of the others it
            predicts the next value itself.
    """

    state_size: int
    angles: tuple[int, ...] = ()
    dynamics_inputs: tuple[int, ...] | None = None
    policy_inputs: tuple[int, ...] | None = None
    differences: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        whole = tuple(range(self.state_size))
        extended = self.state_size + 2 * len(self.angles)
        for name, size in (
            ("angles", self.state_size),
            ("dynamics_inputs", extended),
            ("policy_inputs", extended),
            ("differences", self.state_size),
        ):
            value = getattr(self, name)
            indices = whole if value is None else tuple(int(i) for i in value)
            object.__setattr__(self, name, indices)
            if len(set(indices)) != len(indices) or any(not 0 <= i < size for i in indices):
                raise InvalidSettingError(
                    f"{name} are {indices}; expected different indices from 0 to {size - 1}"
                )

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

    def dynamics_view(self, states: Array) -> Array:
        """Return what the dynamics model sees of states (..., D)."""
        view: Array = self.extend(states)[..., list(self.dynamics_inputs or ())]
        return view

    def targets(self, states: Array) -> Array:
        """Return what the dynamics model predicts, for a run of states (T + 1, D): (T, D)."""
        return states[1:] - states[:-1] * self.difference_mask

    @cached_property
    def difference_mask(self) -> Array:
        """1 where the model predicts an increment, 0 where the next value, shape (D,)."""
        mask = np.zeros(self.state_size)
        mask[list(self.differences or ())] = 1.0
        mask.flags.writeable = False
        return mask

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
