"""The two motions of the robot: a trial of a policy, and the way to the start. No ROS here.

A motion is asked once for every new joint state and is driven by its stamps alone, so that it
does the same at any simulation speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.command_shape import command_shape
from irlpilco_ros.control.controller_settings import ControllerSettings
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
    """

    stamp: int
    values: Vector
    done: bool = False


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


class Trial:
    """Runs a policy for `horizon` ticks.

    Tick k is the first state at or after t0 + k period, t0 being the stamp of the first state it
    is asked about. Until the next tick every state is answered with what follows from the tick's
    decision (see `CommandShape`), stamped as the state of the tick. On tick `horizon` it sends
    zero: that state is x[H].
    """

    name = "trial"
    may_push = True

    def __init__(self, policy: ActingPolicy, horizon: int, period: float) -> None:
        """Run this policy for `horizon` ticks of `period` [s]."""
        self._policy = policy
        self._horizon = horizon
        self._period = round(period * 1e9)
        self._begin: int | None = None
        self._ticks = 0
        self._shape = command_shape(policy)
        self._last = Command(0, np.zeros(0))

    @property
    def ticks(self) -> int:
        """Number of decisions so far."""
        return self._ticks

    def command(self, reading: JointReading) -> Command:
        """Decide, if this state is a tick; else go on by the last decision.

        Raises:
            MotionStoppedError: no state came during a whole period: a tick would be lost.
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


class Approach:
    """Moves straight (in joint space) to the start by velocities alone, and waits for standstill.

    The speed is proportional to the distance, all joints scaled alike so that the fastest keeps
    its limit, and builds up with a bounded acceleration.
    """

    name = "move to start"
    may_push = False

    def __init__(
        self,
        joints: tuple[str, ...],
        goal: Vector,
        velocity_limit: Vector,
        settings: ControllerSettings,
    ) -> None:
        """Move these joints (J) to the goal (J,) [rad], never above velocity_limit (J,) [rad/s]."""
        self._joints = joints
        self._goal = goal
        self._limit = np.minimum(velocity_limit, settings.approach_speed)
        self._settings = settings
        self._begin: int | None = None
        self._elapsed = 0.0
        self._error = np.full(len(joints), np.inf)

    def command(self, reading: JointReading) -> Command:
        """Return the next velocities; zero and done once the robot stands at the start.

        Raises:
            MotionStoppedError: it is not there in time.
        """
        settings = self._settings
        if self._begin is None:
            self._begin = reading.stamp
        self._elapsed = (reading.stamp - self._begin) * 1e-9
        self._error = self._goal - reading.positions
        is_near = bool((np.abs(self._error) <= settings.start_tolerance).all())
        is_slow = bool((np.abs(reading.velocities) <= settings.start_speed_tolerance).all())
        if is_near and is_slow:
            return Command(reading.stamp, np.zeros_like(self._error), done=True)
        if self._elapsed > settings.approach_timeout:
            raise MotionStoppedError(
                f"not at the start after {settings.approach_timeout:g} s: {self._farthest()}, "
                f"tolerance {settings.start_tolerance:g} rad; is the robot blocked, or its servo "
                "too weak for its load?"
            )
        velocities = settings.approach_gain * self._error
        allowed = np.minimum(self._limit, settings.approach_acceleration * self._elapsed)
        velocities *= min(1.0, float((allowed / np.maximum(np.abs(velocities), 1e-12)).min()))
        return Command(reading.stamp, velocities)

    def summary(self) -> str:
        """Say how near the robot is."""
        return f"at the start after {self._elapsed:.2f} s: {self._farthest()}"

    def _farthest(self) -> str:
        joint = int(np.abs(self._error).argmax())
        return f"{self._joints[joint]} is farthest, {self._error[joint]:.4f} rad away"
