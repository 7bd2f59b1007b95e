"""What a simulated robot reports of its joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class SensorReading:
    """All joints at one instant, n of them.

    Attributes:
        stamp: Simulated time [ns].
        names: In the order in which the robot sends them.
        positions: (n,) [rad], or [m] where a joint slides, with sensor noise.
        velocities: (n,) [rad/s] or [m/s], with sensor noise.
        efforts: (n,) [Nm] or [N] of the motors.
    """

    stamp: int
    names: tuple[str, ...]
    positions: Vector
    velocities: Vector
    efforts: Vector

    def state(self, joints: Sequence[str]) -> Vector:
        """Return [positions, velocities] of these joints, in this order, shape (2J,)."""
        index = [self.names.index(joint) for joint in joints]
        return np.concatenate([self.positions[index], self.velocities[index]])
