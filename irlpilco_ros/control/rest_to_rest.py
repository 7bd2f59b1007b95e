"""A smooth way from standing to standing, straight in joint space. No ROS here."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sqrt

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class RestToRest:
    """Speeds that build up, stay, and die down along half waves of a cosine.

    Attributes:
        way: Displacement (J,) [rad].
        blend: Time that the speed builds up, and dies down [s].
        cruise: Time in between [s].
    """

    way: Vector
    blend: float
    cruise: float

    @classmethod
    def within(cls, way: Vector, speed: Vector, acceleration: float) -> RestToRest:
        """Return the quickest one that keeps to speeds (J,) [rad/s] and an acceleration [rad/s²].

        All joints move alike, so that the way is straight.
        """
        share = float(np.max(np.abs(way) / speed, initial=0.0))  # [s] at full speed
        steepest = float(np.max(np.abs(way), initial=0.0))
        # The steepest slope of half a wave of height v over the time b is π v / (2 b).
        blend = 0.0 if share == 0.0 else 0.5 * pi * (steepest / share) / acceleration
        if blend >= share:
            return cls(way, sqrt(0.5 * pi * steepest / acceleration), 0.0)
        return cls(way, blend, share - blend)

    @property
    def duration(self) -> float:
        """Time from standing to standing [s]."""
        return 2.0 * self.blend + self.cruise

    def velocities(self, time: float) -> Vector:
        """Return the speeds (J,) [rad/s] at a time since the start [s]; zero before and after."""
        into = min(time, self.duration - time)
        if into <= 0.0:
            return np.zeros_like(self.way)
        peak = self.way / (self.blend + self.cruise)
        if into >= self.blend:
            return peak
        return np.asarray(peak * 0.5 * (1.0 - cos(pi * into / self.blend)))
