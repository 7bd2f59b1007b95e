"""Whether a robot's joint states are such that it can be controlled by them. No ROS here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.finding import Finding
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.motion import unwrapped
from irlpilco_ros.experience.robot_settings import RobotSettings

Vector = NDArray[np.float64]

STATES_PER_TIMEOUT = 2.0
"""How many joint states have to come within `state_timeout`, so that one may be late."""

_CLOCKS_APART = 0.5  # [s] that a stamp may be off the clock
_CLOCK_RATES_APART = 0.05
_UNTOLD = 0.25  # of a joint's way that its velocities may leave unexplained
_STILL = 0.01  # [rad] that noise, or a rounded velocity, adds to that


@dataclass(frozen=True)
class Arrival:
    """A joint state, as it came.

    Attributes:
        time: When it came, on this computer's clock [s].
        message: The joint state.
        simulated_time: What the last /clock said then [s]; None if there is none.
    """

    time: float
    message: JointStateMessage
    simulated_time: float | None = None


@dataclass(frozen=True)
class _Course:
    """What was heard of one joint; n messages.

    Attributes:
        times: (n,) [s], when they came.
        stamps: (n,) [s] since the first of all.
        positions: (n,) [rad].
        velocities: (n,) [rad/s]; NaN where none is told.
        efforts: (n,) [Nm]; NaN where none is told.
    """

    times: Vector
    stamps: Vector
    positions: Vector
    velocities: Vector
    efforts: Vector

    @property
    def fresh(self) -> Vector:
        """When stamps came that are later than all before (m,) [s]."""
        latest = np.maximum.accumulate(self.stamps)
        return np.asarray(self.times[np.append(True, np.diff(latest) > 0.0)])


def check_joint_states(
    robot: RobotSettings, settings: ControllerSettings, heard: Sequence[Arrival], seconds: float
) -> tuple[Finding, ...]:
    """Return what is right and what is not about joint states.

    Args:
        robot: The robot that they should be of.
        settings: What its controller insists on.
        heard: What came, in this order.
        seconds: For how long it was listened [s].
    """
    own = [each for each in heard if set(each.message.names) & set(robot.joints)]
    if not own:
        others = sorted({name for each in heard for name in each.message.names})
        told = f", which told of {', '.join(others)}" if others else ""
        return (
            Finding(
                False,
                f"joint states: {len(heard)} in {seconds:g} s{told}; expected some of "
                f"{', '.join(robot.joints)}: does the robot's driver run, in this namespace and "
                "ROS_DOMAIN_ID, and on this computer (else: docs/security.md)?",
            ),
        )
    courses = _courses(robot, own)
    check = _Check(robot, settings, own, courses)
    return tuple(check.findings())


class _Check:
    """One look at what was heard."""

    def __init__(
        self,
        robot: RobotSettings,
        settings: ControllerSettings,
        heard: Sequence[Arrival],
        courses: dict[str, _Course],
    ) -> None:
        self._robot, self._settings = robot, settings
        self._heard, self._courses = heard, courses
        self._is_simulated = any(each.simulated_time is not None for each in heard)

    def findings(self) -> Iterable[Finding]:
        yield self._names()
        if self._stands_still():
            yield Finding(
                True,
                "rate: the simulation waits for somebody to command it, and says so on /clock",
            )
        else:
            yield self._rate()
            yield self._gaps()
            yield self._stamps()
            yield self._velocities()
        yield self._clock()
        yield from self._positions()
        if self._robot.effort_limit:
            yield self._efforts()

    def _names(self) -> Finding:
        missing = [joint for joint in self._robot.joints if joint not in self._courses]
        told = {name for each in self._heard for name in each.message.names}
        others = sorted(told - set(self._robot.joints))
        besides = f"; left alone: {', '.join(others)}" if others else ""
        if missing:
            return Finding(False, f"names: nothing of {', '.join(missing)}{besides}")
        return Finding(True, f"names: all {len(self._courses)} joints are told{besides}")

    def _stands_still(self) -> bool:
        """Whether a simulation waits in lockstep: its clock stands where its states do."""
        return self._is_simulated and all(len(each.fresh) < 2 for each in self._courses.values())

    def _rate(self) -> Finding:
        rates = {joint: _rate(course.fresh) for joint, course in self._courses.items()}
        joint = min(rates, key=lambda each: rates[each])
        needed = STATES_PER_TIMEOUT / self._settings.state_timeout
        if rates[joint] >= needed:
            return Finding(True, f"rate: {rates[joint]:.1f} Hz")
        return Finding(
            False,
            f"rate: {rates[joint]:.1f} new states a second of {joint}; expected {needed:.0f} at "
            f"least, {STATES_PER_TIMEOUT:g} within state_timeout = "
            f"{self._settings.state_timeout:g} s",
        )

    def _gaps(self) -> Finding:
        gaps = {
            joint: float(np.diff(course.fresh).max(initial=0.0))
            for joint, course in self._courses.items()
        }
        joint = max(gaps, key=lambda each: gaps[each])
        timeout = self._settings.state_timeout
        if gaps[joint] <= timeout:
            return Finding(True, f"gaps: {gaps[joint] * 1e3:.0f} ms at most")
        return Finding(
            False,
            f"gaps: {gaps[joint]:.2f} s without a new state of {joint}; the controller stops after "
            f"state_timeout = {timeout:g} s: is the network, or a computer, busy?",
        )

    def _stamps(self) -> Finding:
        if any(each.message.stamp == 0 for each in self._heard):
            return Finding(
                False, "stamps: zero; header.stamp has to be the time of the measurement"
            )
        for joint, course in self._courses.items():
            steps = np.diff(course.stamps)
            if (steps < 0.0).any():
                return Finding(
                    False,
                    f"stamps: those of {joint} run back, {(steps < 0.0).sum()} times, by up to "
                    f"{-steps.min():.3f} s: do two drivers tell of it?",
                )
        repeated = 1.0 - sum(len(c.fresh) for c in self._courses.values()) / sum(
            len(c.times) for c in self._courses.values()
        )
        often = f"; {100.0 * repeated:.0f} % tell an old one again" if repeated > 0.01 else ""
        return Finding(True, f"stamps: they advance{often}")

    def _clock(self) -> Finding:
        stamps = np.array([each.message.stamp * 1e-9 for each in self._heard])
        times = np.array([each.time for each in self._heard])
        if self._is_simulated:
            clock = np.array([each.simulated_time or np.nan for each in self._heard])
            late, name = float(np.nanmedian(clock - stamps)), "/clock"
        else:
            late, name = float(np.median(times - stamps)), "this computer's clock"
        side = "behind" if late > 0.0 else "ahead of"
        if abs(late) > _CLOCKS_APART:
            return Finding(
                False,
                f"clock: stamps are {_duration(abs(late))} {side} {name}; set the clocks alike "
                "(chrony, PTP), or stamp with the node's clock; or is it a simulation that this "
                "computer is too slow for?",
            )
        passed, told = times[-1] - times[0], stamps[-1] - stamps[0]
        is_off = abs(told - passed) > max(_CLOCK_RATES_APART * passed, 0.1)
        if not self._is_simulated and passed > 1.0 and is_off:
            return Finding(
                False,
                f"clock: stamps went on by {told:.2f} s in {passed:.2f} s; a simulation at another "
                "speed has to tell its time on /clock",
            )
        return Finding(True, f"clock: stamps agree with {name} within {abs(late) * 1e3:.0f} ms")

    def _velocities(self) -> Finding:
        dumb = [j for j, c in self._courses.items() if not np.isfinite(c.velocities).all()]
        if dumb:
            return Finding(
                False,
                f"velocities: missing, or no numbers, of {', '.join(dumb)}; policies need them "
                "with every position",
            )
        ways, doubts = {}, {}
        for joint, course in self._courses.items():
            if not np.isfinite(course.positions).all():
                continue  # which is said of the positions
            ways[joint] = float(np.ptp(course.positions))
            steps = 0.5 * (course.velocities[1:] + course.velocities[:-1]) * self._steps(course)
            told = np.append(0.0, np.cumsum(steps))
            off = float(np.ptp(course.positions - told))
            doubts[joint] = off / (_STILL + _UNTOLD * ways[joint])
        joint = max(doubts, key=lambda each: doubts[each], default="")
        if joint and doubts[joint] > 1.0:
            return Finding(
                False,
                f"velocities: those of {joint} do not add up to its positions; it moved "
                f"{ways[joint]:.3f} rad: are they [rad/s], and of the same joint?",
            )
        joint = max(ways, key=lambda each: ways[each], default="")
        if joint and ways[joint] > 2.0 * _STILL:
            return Finding(
                True, f"velocities: true to the positions ({joint} moved {ways[joint]:.3f} rad)"
            )
        return Finding(
            True,
            "velocities: there; nothing moved that would show whether they are true (move it by "
            "hand, or see --nudge)",
        )

    def _steps(self, course: _Course) -> Vector:
        """Return the times between messages (n - 1,) [s], by their stamps if these advance."""
        told = course.stamps[-1] > course.stamps[0]
        return np.diff(course.stamps if told else course.times)

    def _positions(self) -> Iterable[Finding]:
        near = []
        for joint, course in self._courses.items():
            column = self._robot.joints.index(joint)
            lower, upper = self._robot.lower[column], self._robot.upper[column]
            if not np.isfinite(course.positions).all():
                yield Finding(False, f"positions: one of {joint} is no number")
                continue
            now, unit = float(course.positions[-1]), self._robot.units[column]
            if not lower <= now <= upper:
                yield Finding(
                    False,
                    f"positions: {joint} is at {now:.4f} {unit}, beyond its limits "
                    f"[{lower:g}, {upper:g}] {unit}; nothing moves there: are they right, and in "
                    "the same unit?",
                )
                continue
            margin = self._settings.position_margin * self._robot.tolerance_share[column]
            if min(now - lower, upper - now) < margin:
                near.append(joint)
        text = f"; within position_margin of one: {', '.join(near)}" if near else ""
        yield Finding(True, f"positions: of those told within the limits{text}")

    def _efforts(self) -> Finding:
        limits = dict(zip(self._robot.joints, self._robot.effort_limit, strict=True))
        told = {
            joint: float(np.nanmax(np.abs(course.efforts)))
            for joint, course in self._courses.items()
            if np.isfinite(course.efforts).any()
        }
        if not any(told.values()):
            return Finding(True, "efforts: none told, so that effort_limit watches nothing")
        joint = max(told, key=lambda each: told[each] / (limits[each] or np.inf))
        seen = f"{joint} tells {told[joint]:.2f} of {limits[joint]:g} Nm"
        if told[joint] > limits[joint]:
            return Finding(
                False,
                f"efforts: {seen}, which would stop it; leave effort_limit out if they are no Nm",
            )
        return Finding(True, f"efforts: {seen} at most")


def _courses(robot: RobotSettings, heard: Sequence[Arrival]) -> dict[str, _Course]:
    """Return what was heard of each joint, by name, in the robot's order."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    begin = heard[0].message.stamp
    for each in heard:
        message, count = each.message, len(each.message.names)
        if len(message.positions) != count:
            continue
        speeds = message.velocities if len(message.velocities) == count else (np.nan,) * count
        efforts = message.efforts if len(message.efforts) == count else (np.nan,) * count
        stamp = (message.stamp - begin) * 1e-9
        for name, *values in zip(message.names, message.positions, speeds, efforts, strict=True):
            rows.setdefault(name, []).append((each.time, stamp, *values))
    return {
        joint: _course(rows[joint], joint in robot.continuous_joints)
        for joint in robot.joints
        if joint in rows
    }


def _course(rows: Sequence[tuple[float, ...]], is_continuous: bool) -> _Course:
    times, stamps, positions, velocities, efforts = np.array(rows).T
    if is_continuous:
        positions = unwrapped(positions[:, None], ("it",), ("it",))[:, 0]
    return _Course(times, stamps, positions, velocities, efforts)


def _rate(times: Vector) -> float:
    return (len(times) - 1) / float(times[-1] - times[0]) if len(times) > 1 else 0.0


def _duration(seconds: float) -> str:
    """Return a time that may be that of years as somebody would say it."""
    return f"{seconds:.2f} s" if seconds < 3600.0 else f"{seconds / 86400.0:.1f} days"
