"""Motions of the joints over time for a hand that guides them: through waypoints, or to a start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.learning.errors import InvalidSettingError

Vector = NDArray[np.float64]

_CORNER = 0.03  # [s]: corners are rounded over twice this time


class Guidable(Protocol):
    """A motion that a hand can guide the arms through."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names (J,)."""

    @property
    def duration(self) -> float:
        """How long it takes [s]."""

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Return positions (J,) [rad] and velocities (J,) [rad/s] at a time since the start [s]."""


@dataclass(frozen=True)
class GuidedMotion:
    """Straight lines in joint space through waypoints at equal intervals, corners rounded.

    The straight motion is averaged over a window of 0.06 s: speeds are continuous, and at a
    waypoint the path cuts the corner by 0.015 s/2 times the change of speed (below 6 mrad for the
    sweep).

    Attributes:
        joints: Names (J,).
        interval: Time between waypoints [s].
        waypoints: (N, J) positions [rad].
    """

    joints: tuple[str, ...]
    interval: float
    waypoints: NDArray[np.float64]

    def __post_init__(self) -> None:
        waypoints = np.asarray(self.waypoints, dtype=float)
        object.__setattr__(self, "waypoints", waypoints)
        if waypoints.ndim != 2 or waypoints.shape[1] != len(self.joints) or len(waypoints) < 2:
            raise InvalidSettingError(
                f"waypoints have shape {waypoints.shape}; expected at least 2 rows of "
                f"{len(self.joints)} positions, one for each joint"
            )
        if not np.isfinite(waypoints).all():
            row = int(np.argwhere(~np.isfinite(waypoints))[0, 0])
            raise InvalidSettingError(f"waypoint {row} is not finite")
        if not self.interval > 0.0:
            raise InvalidSettingError(f"interval is {self.interval} [s]; expected more than 0 [s]")

    @property
    def duration(self) -> float:
        """Time from the first to the last waypoint [s]."""
        return (len(self.waypoints) - 1) * self.interval

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Return positions (J,) [rad] and velocities (J,) [rad/s] at a time since the start [s].

        Before the start and after the end the motion stands still.
        """
        before, after = time - _CORNER, time + _CORNER
        positions = (self._integral(after) - self._integral(before)) / (2.0 * _CORNER)
        velocities = (self._straight(after) - self._straight(before)) / (2.0 * _CORNER)
        return positions, velocities

    def _segment(self, time: float) -> tuple[int, float]:
        """Return the index of a segment and the time since its start [s]."""
        segment = min(max(int(time // self.interval), 0), len(self.waypoints) - 2)
        return segment, time - segment * self.interval

    def _straight(self, time: float) -> Vector:
        """Return the motion with sharp corners."""
        segment, elapsed = self._segment(time)
        share = min(max(elapsed / self.interval, 0.0), 1.0)
        start, end = self.waypoints[segment], self.waypoints[segment + 1]
        return np.asarray(start + share * (end - start))

    def _integral(self, time: float) -> Vector:
        """Return the integral over time of the motion with sharp corners."""
        segment, elapsed = self._segment(time)
        corners = self.waypoints[: segment + 1]
        whole = self.interval * (corners.sum(axis=0) - 0.5 * (corners[0] + corners[-1]))
        inside = min(max(elapsed, 0.0), self.interval)
        here = self._straight(segment * self.interval + inside)
        outside = elapsed - inside
        return np.asarray(whole + 0.5 * inside * (corners[-1] + here) + outside * here)


@dataclass(frozen=True)
class MinimumJerk:
    """A smooth motion from standing to standing, straight in joint space (minimum jerk).

    Attributes:
        start: (J,) [rad].
        goal: (J,) [rad].
        duration: [s].
    """

    start: Vector
    goal: Vector
    duration: float

    @classmethod
    def within_speed(cls, start: ArrayLike, goal: ArrayLike, speed: float) -> MinimumJerk:
        """Return the approach on which no joint is faster than `speed` [rad/s]."""
        first, last = np.asarray(start, dtype=float), np.asarray(goal, dtype=float)
        distance = float(np.abs(last - first).max())
        # The peak of a minimum-jerk motion is 15/8 of its mean speed.
        return cls(first, last, max(15.0 / 8.0 * distance / speed, 0.5))

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Return positions (J,) [rad] and velocities (J,) [rad/s] at a time since the start [s]."""
        share = min(max(time / self.duration, 0.0), 1.0)
        travelled = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        rate = 30.0 * share**2 * (1.0 - share) ** 2 / self.duration
        way = self.goal - self.start
        return self.start + travelled * way, rate * way
