"""Whether a recording can be what a robot is to imitate: one sentence for each fault."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from irlpilco_ros.experience.errors import UnfitDemonstrationError
from irlpilco_ros.experience.motion import unwrapped
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.shown_motion import (
    ShownMotion,
    Wanted,
    Window,
    samples_of,
    shown_motions,
    within,
)
from irlpilco_ros.experience.trajectory import GAP, Trajectory
from irlpilco_ros.learning.numerics.arrays import Array

# What sensors and stamps may be off by, so that nothing is refused for its noise [rad].
_NOISE = 0.01
# A robot's own limit is measured on another day than its speed.
_FASTER = 1.05
# Part of the speed limit by which a step may differ from the recorded speeds: within a step that
# is as long as a control period, a hand may well change its speed.
_UNTRUE = 0.5
# A step that leads to or from all zeros must be truer than that [rad].
_JUMP = 0.05
_STEP = 0.1  # [s]
_COARSE = 1.1  # control periods between samples


def wanted_by(robot: RobotSettings, window: Window = ()) -> Wanted:
    """Return what a robot needs of a recording."""
    return Wanted(robot.roles, robot.control_period, robot.horizon, robot, window)


def checked_motions(
    recorded: Sequence[Trajectory], robot: RobotSettings, window: Window = ()
) -> tuple[ShownMotion, ...]:
    """Return what recordings of one task show, if the robot can imitate it.

    Args:
        recorded: The recordings.
        robot: The robot.
        window: Begin and end of what is imitated, since the first sample [s]; empty for the motion
            that is found. What lies outside of it is not checked.

    Raises:
        UnfitDemonstrationError: says all that is wrong.
        BagError: a joint was not recorded.
    """
    wanted = wanted_by(robot, window)
    for number, each in enumerate(recorded):
        samples, _ = samples_of(each, wanted)
        wrong = faults(within(samples, window), robot)
        if wrong:
            which = f"number {number + 1} of {len(recorded)}: " if len(recorded) > 1 else ""
            raise UnfitDemonstrationError(which + "; ".join(wrong))
    return shown_motions(recorded, wanted)


def faults(shown: Trajectory, robot: RobotSettings) -> list[str]:
    """Return what keeps a recording from being imitated; nothing if it is sound.

    Args:
        shown: The robot's joints in their order, with finite positions and velocities, as they
            were read.
        robot: Their limits, and which of them turn without end.
    """
    return [*motion_faults(shown, robot), *_pace(shown, robot)]


def motion_faults(shown: Trajectory, robot: RobotSettings) -> list[str]:
    """Return what of the motion a robot cannot do; arguments as `faults`."""
    return [*_beyond_limits(shown, robot), *_steps(shown, robot)]


def _beyond_limits(shown: Trajectory, robot: RobotSettings) -> Iterator[str]:
    """Name the joint that is farthest outside its limits; one that turns without end has none."""
    beyond = np.maximum(robot.lower - shown.positions, shown.positions - robot.upper)
    beyond[:, _continuous(robot)] = -np.inf
    sample, joint = _worst(beyond)
    if beyond[sample, joint] <= _NOISE:
        return
    position, unit = shown.positions[sample, joint], robot.units[joint]
    sentence = (
        f"{robot.joints[joint]} is at {position:.4f} {unit} after {_time(shown, sample):.2f} s, "
        f"outside its limits [{robot.lower[joint]:g}, {robot.upper[joint]:g}]"
    )
    yield sentence + _guess(shown, robot)


def _guess(shown: Trajectory, robot: RobotSettings) -> str:
    """Say what positions outside the limits may be, if it is plain to see."""
    radians = np.deg2rad(shown.positions)
    limited = [j for j in range(len(robot.joints)) if j not in _continuous(robot)]
    fits = (radians >= robot.lower - _NOISE) & (radians <= robot.upper + _NOISE)
    if np.abs(shown.positions[:, limited]).max() > 2.0 * np.pi and fits[:, limited].all():
        return "; it looks as if the positions were in degrees, and radians are expected"
    return ""


def _steps(shown: Trajectory, robot: RobotSettings) -> Iterator[str]:
    """Name the step that is too fast, or else the one that is least true to the recorded speeds.

    From sample to sample, and over a tenth of a second, which noise makes no speed of.
    """
    wide = max(1, round(_STEP / shown.cadence))
    for lag in sorted({1, min(wide, len(shown) - 1)}):
        fault = _too_fast(shown, robot, lag) or _untrue(shown, robot, lag)
        if fault:
            yield fault
            return


def _too_fast(shown: Trajectory, robot: RobotSettings, lag: int) -> str:
    """Name the worst step over `lag` samples that is beyond a speed limit; empty if none is."""
    steps, passed = _steps_over(lag, shown, robot)
    limit = np.array(robot.velocity_limit)
    excess = np.abs(steps) - _FASTER * limit * passed - _NOISE
    if (excess <= 0.0).all():
        return ""
    k, joint = _worst(excess / passed)
    speed, unit = abs(steps[k, joint]) / passed[k, 0], robot.units[joint]
    return (
        f"{robot.joints[joint]} goes from {shown.positions[k, joint]:.4f} to "
        f"{shown.positions[k + lag, joint]:.4f} {unit} in {passed[k, 0]:.3f} s, after "
        f"{_time(shown, k):.2f} s: {speed:.1f} {unit}/s, where its limit is {limit[joint]:g}"
        + _reason(shown, k, lag, joint)
    )


def _untrue(shown: Trajectory, robot: RobotSettings, lag: int) -> str:
    """Name the worst step over `lag` samples that is untrue to its speeds; empty if none is."""
    steps, passed = _steps_over(lag, shown, robot)
    between = np.diff(shown.stamps)[:, None] * (shown.velocities[1:] + shown.velocities[:-1])
    way = np.vstack([np.zeros_like(shown.velocities[:1]), 0.5 * np.cumsum(between, axis=0)])
    expected = way[lag:] - way[:-lag]
    allowed = _UNTRUE * np.array(robot.velocity_limit) * passed + _NOISE
    allowed = np.where(_beside_zero(shown, lag)[:, None], _JUMP, allowed)
    excess = np.abs(steps - expected) - allowed
    if (excess <= 0.0).all():
        return ""
    k, joint = _worst(excess / passed)
    unit = robot.units[joint]
    return (
        f"{robot.joints[joint]} moves by {steps[k, joint]:.4f} {unit} in {passed[k, 0]:.3f} s, "
        f"after {_time(shown, k):.2f} s, where its recorded speeds make "
        f"{expected[k, joint]:.4f} {unit}" + _reason(shown, k, lag, joint)
    )


def _steps_over(lag: int, shown: Trajectory, robot: RobotSettings) -> tuple[Array, Array]:
    """Return how far the joints go over `lag` samples, (n - lag, J), and how long it takes."""
    places = unwrapped(shown.positions, robot.joints, robot.continuous_joints)
    return places[lag:] - places[:-lag], (shown.stamps[lag:] - shown.stamps[:-lag])[:, None]


def _beside_zero(shown: Trajectory, lag: int) -> Array:
    """Return which steps lead to or from a sample where all joints read zero, (n - lag,)."""
    zero = ~shown.positions.any(axis=1) & (shown.positions.shape[1] > 1)
    beside: Array = zero[lag:] | zero[:-lag]
    return beside


def _reason(shown: Trajectory, sample: int, lag: int, joint: int) -> str:
    """Say what may be behind a jump from one sample to a later one."""
    before, after = shown.positions[sample], shown.positions[sample + lag]
    if _beside_zero(shown, lag)[sample]:
        return "; all joints read zero there, as of a sensor that gives no reading"
    turns = abs(after[joint] - before[joint]) / (2.0 * np.pi)
    if 0.8 < turns < 1.2:
        return "; that is a whole turn: name the joint in continuous_joints if it turns without end"
    return ""


def _pace(shown: Trajectory, robot: RobotSettings) -> Iterator[str]:
    """Say where the recording is too coarse for the control period, or has a hole."""
    period, passed = robot.control_period, np.diff(shown.stamps)
    if np.median(passed) > _COARSE * period:
        yield (
            f"it has a sample every {np.median(passed):.3f} s, too few for the control_period of "
            f"{period:g} s: record it at {1.0 / period:g} Hz or more (the recorder's sample_rate)"
        )
    elif passed.max() > GAP * period:
        gap = int(passed.argmax())
        yield (
            f"no sample came for {passed[gap]:.3f} s, {_time(shown, gap):.2f} s after the first "
            f"one; expected one at least every control_period, {period:g} s"
        )


def _worst(excess: Array) -> tuple[int, int]:
    """Return sample and joint of the largest of the numbers (n, J)."""
    sample, joint = divmod(int(excess.argmax()), excess.shape[1])
    return sample, joint


def _continuous(robot: RobotSettings) -> list[int]:
    return [robot.joints.index(joint) for joint in robot.continuous_joints]


def _time(shown: Trajectory, sample: int) -> float:
    """Return the time since the first sample [s]."""
    return float(shown.stamps[sample] - shown.stamps[0])
