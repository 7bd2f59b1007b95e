"""What a motion of the robot is, and one of the two: a trial of a policy. No ROS here.

A motion is asked once for every new joint state and is driven by its stamps alone, so that it
does the same at any simulation speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.command_shape import command_shape
from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.learning.errors import IrlPilcoError

Vector = NDArray[np.float64]


class MotionStoppedError(IrlPilcoError):
    """Something stopped the robot; the message is the reason."""


@dataclass(frozen=True)
class Command:
    """What to send on one joint state.

    Attributes:
        stamp: Stamp of the joint state on which it was decided [ns].
        values: One control per commanded joint (F,): [rad/s], or [N] or [Nm] of effort.
        done: The motion has come to its end; `values` are zero then.
        halts: It was stopped before its end.
    """

    stamp: int
    values: Vector
    done: bool = False
    halts: bool = False


class Motion(Protocol):
    """Decides what to send."""

    @property
    def name(self) -> str:
        """What the robot is doing, for people: "trial"."""

    @property
    def may_push(self) -> bool:
        """Whether, in simulation, it may push against what stops the robot."""

    def command(self, reading: JointReading) -> Command:
        """Return what to send on this state.

        Raises:
            MotionStoppedError: the motion cannot go on; the message says why.
        """

    def summary(self) -> str:
        """Say in one line what came of it, once it is done."""


class ActingPolicy(Protocol):
    """What a trial needs of a policy (see irlpilco_ros.learning.policies)."""

    def act(self, state: Vector, step: int) -> Vector:
        """Return the control (F,) for the state [q, q_dot] (2J,) at this tick."""


class Guard(Protocol):
    """What looks at the state at every tick of a trial."""

    def check(self, tick: int, positions: Vector) -> None:
        """Look at positions (J,) [rad].

        Raises:
            MotionStoppedError: the trial must not go on.
        """


class Trial:
    """Runs a policy for `horizon` ticks.

    Tick k is the first state at or after t0 + k period, t0 being the stamp of the first state it
    is asked about. Until the next tick every state is answered with what follows from the tick's
    decision (see `CommandShape`), stamped as the state of the tick. On tick `horizon` it sends
    zero: that state is x[H].
    """

    name = "trial"
    may_push = True

    def __init__(
        self,
        policy: ActingPolicy,
        horizon: int,
        period: float,
        guard: Guard | None = None,
        on_tick: Callable[[int, int], None] | None = None,
    ) -> None:
        """Run this policy for `horizon` ticks of `period` [s].

        Args:
            policy: Decides.
            horizon: How often, H.
            period: Time between two ticks [s].
            guard: Sees each state of a tick, 0 to H, first.
            on_tick: Called with the number of each tick, 0 to H, and its stamp [ns].
        """
        self._policy = policy
        self._horizon = horizon
        self._period = round(period * 1e9)
        self._begin: int | None = None
        self._ticks = 0
        self._guard = guard
        self._on_tick = on_tick
        self._shape = command_shape(policy)
        self._last = Command(0, np.zeros(0))

    @property
    def ticks(self) -> int:
        """Number of decisions so far."""
        return self._ticks

    def command(self, reading: JointReading) -> Command:
        """Decide, if this state is a tick; else go on by the last decision.

        Raises:
            MotionStoppedError: no state came during a whole period: a tick would be lost; or the
                guard stops it.
        """
        if self._last.done:  # braking
            return self._last
        if self._begin is None:
            self._begin = reading.stamp
        due = self._begin + self._ticks * self._period
        if reading.stamp < due:
            return self._between(reading.stamp)
        if reading.stamp >= due + self._period:
            late = (reading.stamp - due) * 1e-9
            raise MotionStoppedError(
                f"joint states jumped over tick {self._ticks} by {late:.3f} s; a tick needs a "
                f"state within its {self._period * 1e-9:g} s: is the network or the robot stalled?"
            )
        if self._guard is not None:
            self._guard.check(self._ticks, reading.positions)
        if self._on_tick is not None:
            self._on_tick(self._ticks, reading.stamp)
        if self._ticks == self._horizon:
            self._last = Command(reading.stamp, np.zeros_like(self._last.values), done=True)
            return self._last
        self._shape.decide(self._decide(reading.state))
        self._ticks += 1
        self._last = Command(reading.stamp, self._shape.at((reading.stamp - due) / self._period))
        return self._last

    def _between(self, stamp: int) -> Command:
        """Return the command at a stamp between two ticks: the last one, if it is held."""
        assert self._begin is not None
        elapsed = (stamp - self._begin) / self._period - (self._ticks - 1)
        values = self._shape.at(elapsed)
        if not np.array_equal(values, self._last.values):
            self._last = Command(self._last.stamp, values)
        return self._last

    def _decide(self, state: Vector) -> Vector:
        try:
            return np.array(self._policy.act(state, self._ticks), dtype=float)
        except Exception as error:  # whatever a policy of another package does
            raise MotionStoppedError(f"the policy failed at tick {self._ticks}: {error}") from error

    def summary(self) -> str:
        """Say how many ticks it took."""
        seconds = self._horizon * self._period * 1e-9
        return f"trial over: {self._ticks} decisions in {seconds:g} s"
