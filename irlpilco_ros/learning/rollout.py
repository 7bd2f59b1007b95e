"""What happened in one run: the states that were seen and the controls that were sent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class Rollout:
    """One demonstration or one trial, sampled once per control period.

    Attributes:
        states: x[0..T], shape (T + 1, D): joint positions [rad], then joint velocities [rad/s].
        controls: u[0..T-1], shape (T, F) [rad/s]; all NaN if nobody commanded the robot.
    """

    states: Array
    controls: Array

    def __post_init__(self) -> None:
        states = np.asarray(self.states, dtype=float)
        controls = np.asarray(self.controls, dtype=float)
        object.__setattr__(self, "states", states)
        object.__setattr__(self, "controls", controls)
        if states.ndim != 2 or controls.ndim != 2 or len(states) != len(controls) + 1:
            raise InvalidSettingError(
                f"a rollout needs states (T + 1, D) and controls (T, F); "
                f"got {states.shape} and {controls.shape}"
            )
        if len(controls) == 0:
            raise InvalidSettingError("a rollout needs at least one step; it has one state only")
        if not np.isfinite(states).all():
            step = int(np.argwhere(~np.isfinite(states))[0, 0])
            raise InvalidSettingError(f"the state at step {step} of a rollout is not finite")
        if self.commanded and not np.isfinite(controls).all():
            step = int(np.argwhere(~np.isfinite(controls))[0, 0])
            raise InvalidSettingError(
                f"the control at step {step} of a rollout is not finite; expected a number at "
                "every step, or NaN at every step if nobody commanded the robot"
            )

    @property
    def steps(self) -> int:
        """Number of control periods T."""
        return len(self.controls)

    @property
    def commanded(self) -> bool:
        """Whether controls were sent, so that a dynamics model can learn from it."""
        return not bool(np.isnan(self.controls).all())

    def inputs(self) -> Array:
        """Return the pairs (x[t], u[t]) that dynamics learn from, shape (T, D + F)."""
        return np.hstack([self.states[:-1], self.controls])

    def increments(self) -> Array:
        """Return x[t+1] - x[t], shape (T, D)."""
        return np.diff(self.states, axis=0)


def mean_command(sent: Array) -> Array:
    """Return the mean (F,) of the commands (n, F) that answered the states of a period.

    That is what a dynamics model learns from. One that was held is its own mean, to the last bit.
    """
    if (sent == sent[0]).all():
        return np.array(sent[0])
    mean: Array = sent.mean(axis=0)
    return mean
