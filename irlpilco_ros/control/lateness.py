"""How far a robot runs behind its commands, seen on one way from standing to standing."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_SHORTEST = 0.05  # [rad]: a shorter way says nothing above the noise
_AT_END = 0.75  # of speed times lag, which a lag leaves to go where a way ends: it ends smoothly
_LONGEST = 2.0  # [s]: who runs behind by more is not late but drifts
_REMAINDER = 0.0007  # [rad] that may still be missing when the robot is looked at
_NO_LAG = 0.05  # [s]


class Lateness:
    """Compares how much of a way was commanded, and how much was gone, over its time.

    Both rise from 0 to 1. What lies between them is the time from a command to its effect: the
    area its mean, delay + lag, and the first moment with it its variance, lag² of a first-order
    servo behind a delay.

    Attributes:
        delay: Time until a command begins to act [s], 0 before anything was seen.
        lag: Time constant at which the robot follows then [s].
    """

    def __init__(self) -> None:
        """Know nothing."""
        self.delay = self.lag = 0.0
        self.begin(np.zeros(1), 0.0)

    @property
    def mean(self) -> float:
        """Mean time from a command to its effect [s]."""
        return self.delay + self.lag

    @property
    def remainder(self) -> float:
        """What may still be missing of a way that has settled [rad]; nothing without a lag."""
        return _REMAINDER if self.lag > _NO_LAG else 0.0

    def begin(self, way: Vector, speed: float) -> None:
        """Watch a way (J,) [rad] from here, at most so fast [rad/s]; its longest joint tells."""
        self._joint = int(np.abs(way).argmax())
        self._length = float(np.abs(way).max())
        self._speed = speed
        self._times: list[float] = []
        self._commanded: list[float] = []
        self._gone: list[float] = []

    def take(self, now: float, positions: Vector, commanded: Vector) -> None:
        """Take in positions (J,) [rad] and the integral of the commands (J,) up to now [s]."""
        self._times.append(now)
        self._commanded.append(float(commanded[self._joint]))
        self._gone.append(float(positions[self._joint]))

    def settling(self) -> float:
        """Return how long after the way's end all but a remainder of it is gone [s]."""
        if self._length > _SHORTEST and len(self._times) > 1:
            self._measure()
        missing = min(self._length, _AT_END * self._speed * self.lag)
        return self.delay + self.lag * math.log(max(1.0, missing / _REMAINDER))

    def _measure(self) -> None:
        times = np.array(self._times) - self._times[0]
        commanded, gone = _share(self._commanded), _share(self._gone)
        mean = min(max(0.0, float(np.trapezoid(commanded - gone, times))), _LONGEST)
        begin = float(np.trapezoid(1.0 - commanded, times))
        square = 2.0 * float(np.trapezoid(times * (commanded - gone), times)) - 2.0 * begin * mean
        self.lag = min(mean, math.sqrt(max(0.0, square - mean**2)))
        self.delay = mean - self.lag


def _share(values: list[float]) -> Vector:
    way = np.array(values) - values[0]
    return np.asarray(way / (way[-1] or 1.0))
