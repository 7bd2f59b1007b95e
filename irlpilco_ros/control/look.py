"""A look at a robot that stands or slides: where it is and how fast, the noise averaged out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_WINDOW = 0.3  # [s]
_FEWEST = 6  # states
_LONGEST_SETTLING = 3.0  # [s]
_SETTLED = 0.005  # [rad/s] that the speed may change by within a window, beyond its noise
_NOISE = 4.0  # standard deviations


@dataclass(frozen=True)
class Look:
    """What was seen in the middle of a window of time.

    Attributes:
        time: [s].
        position: (J,) [rad].
        speed: (J,) [rad/s].
        position_error: (J,) standard deviation of the position [rad].
        speed_error: (J,) of the speed [rad/s]: noise, and what had not settled yet.
    """

    time: float
    position: Vector
    speed: Vector
    position_error: Vector
    speed_error: Vector


class LookTaker:
    """Gathers states until they make a look."""

    def __init__(self) -> None:
        """Begin to gather with the next state."""
        self.begin()

    def begin(self) -> None:
        """Gather anew, from the next state on."""
        self._from = math.inf
        self._times: list[float] = []
        self._positions: list[Vector] = []

    def take(self, now: float, positions: Vector) -> Look | None:
        """Take in a state; return the look once there is one.

        Args:
            now: [s].
            positions: (J,) [rad].
        """
        self._from = min(self._from, now)
        self._times.append(now)
        self._positions.append(positions)
        while now - self._times[0] > _WINDOW + 1e-6:
            del self._times[0], self._positions[0]
        if now - self._from < _WINDOW - 1e-6 or len(self._times) < _FEWEST:
            return None
        look, is_settled = self._fit()
        return look if is_settled or now - self._from > _LONGEST_SETTLING else None

    def _fit(self) -> tuple[Look, bool]:
        """Fit position, speed and half the acceleration around the middle of the window."""
        times, positions = np.array(self._times), np.array(self._positions)
        middle = float(times.mean())
        basis = np.stack([np.ones_like(times), times - middle, (times - middle) ** 2], axis=1)
        inverse = np.linalg.inv(basis.T @ basis)
        curve = inverse @ basis.T @ positions
        rest = positions - basis @ curve
        noise = np.sqrt((rest**2).sum(axis=0) / max(1, len(times) - 3)) + 1e-6
        error = np.sqrt(np.diag(inverse))[:, None] * noise
        span = float(times[-1] - times[0])
        change = 2.0 * curve[2] * span  # of the speed, from the window's begin to its end
        bound = _SETTLED + _NOISE * 2.0 * error[2] * span
        line = basis[:, :2]
        level, speed = np.linalg.lstsq(line, positions, rcond=None)[0]
        look = Look(
            time=middle,
            position=level,
            speed=speed,
            position_error=noise / np.sqrt(len(times)),
            speed_error=np.hypot(error[1], change),
        )
        return look, bool((np.abs(change) <= bound).all())
