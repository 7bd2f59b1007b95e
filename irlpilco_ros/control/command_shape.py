"""What a policy commands between its decisions. No ROS here.

With c(t) the part of a policy that depends on time alone and u[k] its decision at tick k, the
command during period k is c(t) + e(t), where e goes smoothly, over the first part r of the period,
from what it was to

    e[k] = (u[k] - mean of c over the period - r/2 e[k-1]) / (1 - r/2),

so that the mean command of the period is u[k]. Before the trial the robot stands: e[-1] = -c(0).
With r = 0 and no c that is a command held for the period.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_TIMES, _SHARES = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS  # of a period, for its mean


class ShapedPolicy(Protocol):
    """What the shape of commands needs of a policy."""

    @property
    def blend(self) -> float:
        """Part r of each period over which a decision is blended in, from 0 to 1."""

    def between(self, time: float) -> Vector:
        """Return the part of the control (F,) that depends on time alone [control periods]."""


class CommandShape:
    """The commands of one trial, from decisions to what is sent."""

    def __init__(self, policy: ShapedPolicy) -> None:
        """Begin at rest."""
        self._policy = policy
        self._blend = policy.blend
        self._tick = -1
        self._target = -policy.between(0.0)
        self._before = self._target

    def decide(self, control: Vector) -> None:
        """Take the decision of the next tick, controls (F,)."""
        self._tick += 1
        times = self._tick + _TIMES
        mean = np.sum([w * self._policy.between(t) for w, t in zip(_SHARES, times, strict=True)], 0)
        half = 0.5 * self._blend
        self._before = self._target
        self._target = (control - mean - half * self._before) / (1.0 - half)

    def at(self, elapsed: float) -> Vector:
        """Return the command (F,) at a time since the last tick, in control periods."""
        share = min(elapsed / self._blend, 1.0) if self._blend > 0.0 else 1.0
        smooth = share * share * (3.0 - 2.0 * share)
        blended = self._before + smooth * (self._target - self._before)
        command: Vector = self._policy.between(self._tick + elapsed) + blended
        return command
