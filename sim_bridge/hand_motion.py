"""A motion as a person's hand shows it: smooth, from rest to rest, with a small tremor.

The way through the waypoints is a monotone cubic (it never overshoots a waypoint) averaged over a
Gaussian of 0.12 s, so that accelerations stay where a hand's are (peaks below 2 rad/s^2 for the
sweep). Physiological tremor is a few hundredths of a milliradian at 6 to 9 Hz; it is always the
same, so that a demonstration can be shown again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from sim_bridge.guided_motion import GuidedMotion

Vector = NDArray[np.float64]

_REST = 0.3  # [s] in which the hand sets off before the first waypoint, and comes to rest
_SMOOTHING = 0.12  # [s], standard deviation of the average
_TREMOR = 4e-5  # [rad], amplitude of each of its parts
_FREQUENCIES = (6.0, 9.0)  # [Hz], their range
_PARTS = 3
_RISE = 0.5  # [s] over which the tremor comes and goes
_STEP = 1e-3  # [s] between the knots of the course


@dataclass(frozen=True)
class HandMotion(GuidedMotion):
    """A smooth motion past waypoints; attributes as `GuidedMotion`."""

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Return positions (J,) [rad] and velocities (J,) [rad/s] at a time since the start [s].

        Before the start and after the end the motion stands still.
        """
        if not 0.0 < time < self.duration:
            ends: Vector = self._course(min(max(time, 0.0), self.duration))
            return ends, np.zeros_like(ends)
        return self._course(time), self._course(time, 1)

    @cached_property
    def _course(self) -> CubicHermiteSpline:
        """The motion over time, (J,) each."""
        count, margin = len(self.waypoints), round(4.0 * _SMOOTHING / _STEP)
        at = np.linspace(_REST, self.duration - _REST, count)
        times = np.arange(-margin, round(self.duration / _STEP) + margin + 1) * _STEP
        through = PchipInterpolator(at, self.waypoints, axis=0)(np.clip(times, at[0], at[-1]))
        smooth = gaussian_filter1d(through, _SMOOTHING / _STEP, axis=0, mode="nearest")
        smooth += self._tremor(times)
        return CubicHermiteSpline(times, smooth, np.gradient(smooth, _STEP, axis=0))

    def _tremor(self, times: NDArray[np.floating]) -> NDArray[np.float64]:
        rng = np.random.default_rng(len(self.joints))
        shape = (_PARTS, len(self.joints))
        frequencies, phases = rng.uniform(*_FREQUENCIES, shape), rng.uniform(0, 2 * np.pi, shape)
        turns = 2 * np.pi * frequencies * times[:, None, None] + phases
        rise = np.clip(np.minimum(times, self.duration - times) / _RISE, 0.0, 1.0)
        tremor: NDArray[np.float64] = _TREMOR * rise[:, None] * np.sin(turns).sum(axis=1)
        return tremor
