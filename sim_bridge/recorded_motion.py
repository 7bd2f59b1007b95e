"""A motion that was recorded, for a hand that guides the arms through it once more."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class RecordedMotion:
    """The smooth curve through states that were recorded.

    Attributes:
        joints: Names (J,).
        times: Since the motion began, shape (n,), rising from 0 [s].
        positions: Shape (n, J) [rad].
        velocities: Shape (n, J) [rad/s].
    """

    joints: tuple[str, ...]
    times: Vector
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]

    @property
    def duration(self) -> float:
        """Time from the first to the last state [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Return positions (J,) [rad] and velocities (J,) [rad/s] at a time since the start [s].

        Before the start and after the end the motion stands still.
        """
        place: Vector = self._curve(min(max(time, 0.0), self.duration))
        if not 0.0 < time < self.duration:
            return place, np.zeros_like(place)
        return place, self._curve(time, 1)

    @cached_property
    def _curve(self) -> CubicHermiteSpline:
        return CubicHermiteSpline(self.times, self.positions, self.velocities)
