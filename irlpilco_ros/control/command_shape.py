"""What a policy commands between its decisions. No ROS here.

With c(t) the part of a policy that depends on time alone and u[k] its decision at tick k, the
command during period k is c(t) + e(t), where e goes smoothly, over the first part r of the period,
from what it was to

    e[k] = (u[k] - mean of c over the period - r/2 e[k-1]) / (1 - r/2),

so that the mean command of the period is u[k], as long as no command is beyond the policy's limit.
Before the trial the robot stands: e[-1] = -c(0). With r = 0 and no c that is a command held for the
period.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_TIMES, _SHARES = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS  # of a period, for its mean


@runtime_checkable
class ShapedPolicy(Protocol):
    """A policy that knows what to command between its decisions."""

    @property
    def control_limit(self) -> Vector:
        """Largest absolute value of each control, shape (F,)."""

    @property
    def blend(self) -> float:
        """Part r of each period over which a decision is blended in, from 0 to 1."""

    def between(self, time: float) -> Vector:
        """Return the part of the control (F,) that depends on time alone [control periods]."""


class HeldCommand:
    """Each decision is held until the next one."""

    def __init__(self) -> None:
        """Begin at rest."""
        self._control = np.zeros(0)

    def decide(self, control: Vector) -> None:
        """Take the decision of the next tick, controls (F,)."""
        self._control = control

    def at(self, elapsed: float) -> Vector:
        """Return the command (F,)."""
        return self._control


def command_shape(policy: object) -> HeldCommand | CommandShape:
    """Return the shape of the commands in one trial of a policy."""
    return CommandShape(policy) if isinstance(policy, ShapedPolicy) else HeldCommand()


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
        wanted = self._policy.between(self._tick + elapsed) + self._added(elapsed)
        limit = self._policy.control_limit
        command: Vector = np.clip(wanted, -limit, limit)
        return command

    def _added(self, elapsed: float) -> Vector:
        """Return e (F,)."""
        if elapsed >= self._blend:
            return self._target
        share = elapsed / self._blend
        smooth = share * share * (3.0 - 2.0 * share)
        return self._before + smooth * (self._target - self._before)
