"""How fast commands may change. No ROS here.

Velocities that jump wear gears, and many drives stop at them. Whatever a motion commands is brought
within the robot's acceleration limit before it goes out; only an emergency stop is not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


class AccelerationLimit:
    """Keeps one motion's commands within a limit on their change; the robot stands at first."""

    def __init__(self, limit: Vector) -> None:
        """Keep to this limit (F,) [rad/s^2]; empty for none."""
        self._limit = limit
        self._last: tuple[int, Vector] | None = None

    def limited(self, stamp: int, values: Vector) -> Vector:
        """Return the nearest command (F,) to the one wanted that may follow the last one.

        Args:
            stamp: Of the joint state that is answered [ns]; time passes by the stamps.
            values: The wanted command (F,) [rad/s].
        """
        if not self._limit.size:
            return values
        if self._last is None:
            self._last = stamp, np.zeros(len(values))
        before, last = self._last
        reach = self._limit * max(stamp - before, 0) * 1e-9
        nearest = np.clip(values, last - reach, last + reach)
        self._last = max(stamp, before), nearest
        return nearest
