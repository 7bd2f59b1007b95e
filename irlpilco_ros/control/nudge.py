"""A nudge of each joint: what it makes of its commands, how late, and whether it stops unasked.

One joint after the other goes a hundredth of a radian towards the middle of its range, and back.
No ROS here.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.finding import Finding
from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.control.motions import Command
from irlpilco_ros.experience.robot_settings import RobotSettings

Vector = NDArray[np.float64]

WAY = 0.01
"""How far a joint goes [rad], or [m] if it slides; less of one that goes less than 1 in all."""

_SPEED = 0.04  # [rad/s]
_LOOK = 0.3  # [s] in which noise is averaged out
_SETTLE = 0.9  # [s] from the command's end to its last effect
_REST = 0.5  # [s] on the way back
_PUSH = 0.3  # [s] at half the speed, before commands are held back
_WITHHELD = 1.0  # [s] without a command
_LEAST_GAIN, _LARGEST_GAIN = 0.3, 3.0
_ASTRAY = 0.4  # of the way that another joint may go
_UNTOLD, _NOISE = 0.3, 0.002  # of the way, and [rad], that velocities may leave unexplained


@dataclass(frozen=True)
class _Part:
    """So long [s] at this speed (F,) [rad/s]; `withheld`: nothing is sent meanwhile."""

    duration: float
    speed: Vector
    withheld: bool = False


class Nudge:
    """Moves the robot's commanded joints by a little; a `Motion` for `MotionControl`."""

    name = "nudge"
    may_push = False

    def __init__(self, robot: RobotSettings, tries_timeout: bool) -> None:
        """Nudge this robot; at the end let the first joint go without commands, if asked to."""
        self._robot = robot
        self._tries_timeout = tries_timeout
        self._parts: list[_Part] = []
        self._begin: int | None = None
        self._times: list[float] = []
        self._readings: list[JointReading] = []

    @property
    def withheld(self) -> bool:
        """Whether the last command is not to be sent, to see whether the robot stops by itself."""
        return bool(self._times) and self._part(self._times[-1])[1].withheld

    def command(self, reading: JointReading) -> Command:
        """Return the next velocities."""
        if self._begin is None:
            self._begin = reading.stamp
            self._parts = list(self._plan(reading.positions))
        time = (reading.stamp - self._begin) * 1e-9
        self._times.append(time)
        self._readings.append(reading)
        number, part = self._part(time)
        return Command(reading.stamp, part.speed, done=number == len(self._parts))

    def summary(self) -> str:
        """Say that it is over."""
        return f"nudged in {self._times[-1]:.1f} s"

    def findings(self, longest_delay: float) -> Iterable[Finding]:
        """Say what came of it.

        Args:
            longest_delay: What the way to the start allows for [s].
        """
        first = None
        for number, joint in enumerate(self._robot.roles.commanded):
            if not self._robot.control_limit[number]:
                yield Finding(True, f"{joint}: not nudged, velocity_limit 0 holds it still")
                continue
            seen = self._seen(number)
            first = first or seen
            yield self._judged(joint, seen, longest_delay)
        if first is not None and self._tries_timeout:
            yield self._timeout(first)

    def _plan(self, positions: Vector) -> Iterable[_Part]:
        columns = self._robot.roles.commanded_columns
        middle = 0.5 * (self._robot.lower + self._robot.upper)
        sides = np.where(positions > middle, -1.0, 1.0)[columns]
        share = self._robot.tolerance_share[columns]
        speeds = np.minimum(_SPEED * share, self._robot.control_limit) * sides
        still = np.zeros(len(columns))
        for number, speed in enumerate(speeds):
            if speed:
                going = still.copy()
                going[number] = speed
                duration = WAY * share[number] / abs(speed)
                yield _Part(_LOOK, still)
                yield _Part(duration, going)
                yield _Part(_SETTLE, still)
                yield _Part(duration, -going)
                yield _Part(_REST, still)
        if self._tries_timeout and speeds.any():
            going = still.copy()
            number = int(np.flatnonzero(speeds)[0])
            going[number] = 0.5 * speeds[number]
            yield _Part(_PUSH, going)
            yield _Part(_WITHHELD, going, withheld=True)
            yield _Part(_REST, still)

    def _part(self, time: float) -> tuple[int, _Part]:
        """Return which part a time [s] is in, the last one being a standstill."""
        end = 0.0
        for number, part in enumerate(self._parts):
            end += part.duration
            if time < end - 1e-9:
                return number, part
        return len(self._parts), _Part(0.0, np.zeros(len(self._robot.roles.commanded)))

    def _begin_of(self, number: int) -> float:
        return sum(part.duration for part in self._parts[:number])

    def _during(self, begin: float, end: float) -> tuple[Vector, Vector, Vector]:
        """Return times (n,) [s], positions and velocities (n, J) of this stretch of time."""
        chosen = [k for k, time in enumerate(self._times) if begin <= time <= end + 1e-9]
        readings = [self._readings[k] for k in chosen]
        return (
            np.array([self._times[k] for k in chosen]),
            np.array([reading.positions for reading in readings]),
            np.array([reading.velocities for reading in readings]),
        )

    def _seen(self, number: int) -> _Seen:
        moved = [k for k, limit in enumerate(self._robot.control_limit) if limit].index(number)
        column = self._robot.roles.commanded_columns[number]
        look = 5 * moved
        going = self._parts[look + 1]
        begin = self._begin_of(look + 1)
        end = begin + going.duration + _SETTLE
        _, before, _ = self._during(begin - _LOOK, begin)
        _, after, _ = self._during(end - _LOOK, end)
        way = after.mean(axis=0) - before.mean(axis=0)
        wanted = float(going.speed[number]) * going.duration
        times, positions, velocities = self._during(begin, end)
        told = float(np.trapezoid(velocities[:, column], times))
        commanded = np.clip((times - begin) / going.duration, 0.0, 1.0) * wanted
        gain = float(way[column]) / wanted
        gone = positions[:, column] - before[:, column].mean()
        late = float(np.trapezoid(commanded * gain - gone, times)) / (gain * wanted or np.inf)
        others = np.abs(np.delete(way, column))
        astray = np.delete(np.arange(len(way)), column)[others.argmax()] if others.size else -1
        return _Seen(column, going, wanted, gain, late, told, way, int(astray))

    def _judged(self, joint: str, seen: _Seen, longest_delay: float) -> Finding:
        text = f"{joint}: makes {seen.gain:.2f} of its command, {seen.late * 1e3:.0f} ms later"
        others = float(abs(seen.way[seen.astray])) if seen.astray >= 0 else 0.0
        if others > _ASTRAY * abs(seen.wanted):
            other = self._robot.joints[seen.astray]
            return Finding(
                False,
                f"{joint}: when it was commanded {seen.wanted:+.3f} rad, {other} went "
                f"{seen.way[seen.astray]:+.4f} rad; are the joints in the receiver's order?",
            )
        if not _LEAST_GAIN <= seen.gain <= _LARGEST_GAIN:
            return Finding(
                False,
                f"{joint}: commanded {seen.wanted:+.3f} rad, it went "
                f"{seen.way[seen.column]:+.4f} rad; does it hear joint_command, in [rad/s]?",
            )
        if seen.late > longest_delay:
            return Finding(False, f"{text}; set approach_delay above it (now {longest_delay:g} s)")
        moved = float(seen.way[seen.column])
        if abs(seen.told - moved) > _UNTOLD * abs(moved) + _NOISE * abs(seen.wanted) / WAY:
            return Finding(
                False,
                f"{text}, but its velocities add up to {seen.told:+.4f} rad where it went "
                f"{moved:+.4f} rad: are they [rad/s], and of this joint?",
            )
        return Finding(True, text)

    def _timeout(self, first: _Seen) -> Finding:
        """Say whether a joint goes on without commands, and how long."""
        number = next(k for k, part in enumerate(self._parts) if part.withheld)
        begin, speed = self._begin_of(number), 0.5 * first.gain * float(np.sum(first.going.speed))
        times, positions, _ = self._during(begin, begin + _WITHHELD)
        gone = positions[:, first.column]
        joint = self._robot.joints[first.column]
        late = times > begin + 0.5 * _WITHHELD
        slope = float(np.polyfit(times[late], gone[late], 1)[0])
        if slope / speed > 0.5:
            return Finding(
                False,
                f"time-out: {joint} goes on for {_WITHHELD:g} s without a command; whatever ends "
                "the controller would let it go on for ever: give its receiver a time-out below "
                "0.5 s (msgs_docs/velocity_controller.commands.md)",
            )
        lasted = float(gone[-5:].mean() - gone[:3].mean()) / speed - first.late
        return Finding(
            True, f"time-out: {joint} stops {max(lasted, 0.0):.1f} s after its last command"
        )


@dataclass(frozen=True)
class _Seen:
    """What came of one joint's nudge.

    Attributes:
        column: The joint's, among all.
        going: How it was commanded.
        wanted: Where to [rad].
        gain: Part of that which it went.
        late: Mean time from command to effect [s].
        told: What its velocities add up to [rad].
        way: What each joint went (J,) [rad].
        astray: The joint, among all, that went farthest besides; -1 if there is no other.
    """

    column: int
    going: _Part
    wanted: float
    gain: float
    late: float
    told: float
    way: Vector
    astray: int
