"""From a recording to what is imitated: checked, cut to the motion, at the control period.

What comes before and after the motion is left out, and the samples are brought to the times at
which the policy will decide, by their stamps; a sample's index is nowhere taken for time.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.experience.demonstration_checks import faults
from irlpilco_ros.experience.errors import BagError, UnfitDemonstrationError
from irlpilco_ros.experience.motion import Motion, find_motion, unwrapped
from irlpilco_ros.experience.resampling import measured_velocities, resample
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.trajectory import PACE, Trajectory
from irlpilco_ros.learning.rollout import Rollout

Window = tuple[float, ...]
"""Empty, or begin and end of what is imitated, since the first sample [s]."""

# Part of a control period that may be left out at the end, or be missing there.
_ROUNDING = 0.05


@dataclass(frozen=True)
class ShownMotion:
    """What a recording shows.

    Attributes:
        rollout: States at the control period; controls if somebody commanded the robot.
        samples: The robot's joints as they were recorded, with the velocities that were missing.
        motion: What moves in it; None if it was not looked for, as when it is commanded.
        begin: Time of x[0] since the first sample [s].
        notes: What its user should know.
    """

    rollout: Rollout
    samples: Trajectory
    motion: Motion | None
    begin: float
    notes: tuple[str, ...] = ()


def shown_motion(recorded: Trajectory, robot: RobotSettings, window: Window = ()) -> ShownMotion:
    """Return what a recording shows to a robot.

    If the robot was commanded at its control period, that is taken as it is: somebody who knows
    how has shown it by a policy.

    Args:
        recorded: The recording.
        robot: Joints, limits, control period, horizon, and what counts as motion.
        window: What to take instead of the motion that is found.

    Raises:
        UnfitDemonstrationError: it cannot be imitated; says all that is wrong with it.
        BagError: a joint was not recorded.
    """
    if _is_trial(recorded, robot) and not window:
        rollout = recorded.rollout(robot.roles, robot.horizon or None)
        return ShownMotion(rollout, robot_samples(recorded, robot)[0], None, 0.0)
    samples, notes = robot_samples(recorded, robot)
    if recorded.commanded.any():
        notes = (*notes, "commands that were recorded are not decisions, and are left out")
    wanted = _within(samples, window) if window else samples
    wrong = faults(wanted, robot)
    if wrong:
        raise UnfitDemonstrationError("; ".join(wrong))
    motion = None
    if not window and robot.cut_to_motion:
        motion = _found_motion(samples, robot)
    return _on_ticks(samples, robot, motion, window, notes)


def robot_samples(recorded: Trajectory, robot: RobotSettings) -> tuple[Trajectory, tuple[str, ...]]:
    """Return the samples of the robot's joints, without commands, and notes about them.

    Velocities that were not recorded are computed from the positions.

    Raises:
        UnfitDemonstrationError: there are fewer than two samples, or one is not finite.
        BagError: a joint was not recorded.
    """
    columns, whole = recorded.columns(robot.joints), recorded.observed
    if whole.sum() < 2:
        raise UnfitDemonstrationError(f"it has {whole.sum()} samples of the robot's joints")
    positions = recorded.positions[whole][:, columns]
    velocities = recorded.velocities[whole][:, columns]
    stamps = recorded.stamps[whole]
    if not np.isfinite(positions).all():
        sample, joint = np.argwhere(~np.isfinite(positions))[0]
        raise UnfitDemonstrationError(
            f"{robot.joints[joint]} is at {positions[sample, joint]} rad in sample {sample}"
        )
    velocities, notes = _filled(stamps, positions, velocities, robot)
    nothing = np.full_like(positions, np.nan)
    return Trajectory(robot.joints, stamps, positions, velocities, nothing), notes


def _is_trial(recorded: Trajectory, robot: RobotSettings) -> bool:
    """Whether commands were decided once per control period."""
    decided = recorded.stamps[recorded.commanded]
    if not len(decided):
        return False
    return (
        len(decided) < 2
        or abs(np.median(np.diff(decided)) - robot.control_period) < PACE * robot.control_period
    )


def _filled(
    stamps: np.ndarray, positions: np.ndarray, velocities: np.ndarray, robot: RobotSettings
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return velocities without holes, and a note about those that were computed."""
    places = unwrapped(positions, robot.joints, robot.continuous_joints)
    absent = ~np.isfinite(velocities)
    # Drivers that know no speeds may publish zeros.
    moving = np.ptp(places, axis=0) > robot.motion_distance
    absent |= moving & ~np.where(absent, 0.0, velocities).any(axis=0)
    if not absent.any():
        return velocities, ()
    names = [joint for joint, holes in zip(robot.joints, absent.T, strict=True) if holes.any()]
    whose = "" if len(names) == len(robot.joints) else f" of {', '.join(names)}"
    note = f"velocities{whose} that were not recorded are computed from the positions"
    return np.where(absent, measured_velocities(stamps, places), velocities), (note,)


def _within(samples: Trajectory, window: Window) -> Trajectory:
    """Return the samples in a window, and those on both sides of it."""
    if len(window) != 2 or not 0.0 <= window[0] < window[1]:
        raise UnfitDemonstrationError(
            f"demonstration_window is {list(window)}; expected begin and end [s] since the first "
            "sample, such as [1.9, 10.0]"
        )
    times = samples.stamps - samples.stamps[0]
    if window[1] > times[-1] + 0.5 * samples.cadence:
        raise UnfitDemonstrationError(
            f"demonstration_window is {list(window)}, but {times[-1]:.2f} s were recorded"
        )
    first = max(0, int(np.searchsorted(times, window[0], side="right")) - 1)
    last = int(np.searchsorted(times, window[1])) + 1
    return _slice(samples, slice(first, last))


def _slice(samples: Trajectory, part: slice) -> Trajectory:
    arrays = ("stamps", "positions", "velocities", "commands")
    return dataclasses.replace(samples, **{name: getattr(samples, name)[part] for name in arrays})


def _found_motion(samples: Trajectory, robot: RobotSettings) -> Motion:
    motion = find_motion(
        samples.stamps, samples.positions, samples.joint_names, robot, robot.continuous_joints
    )
    if motion is None:
        raise UnfitDemonstrationError(
            f"nothing moves in its {samples.stamps[-1] - samples.stamps[0]:.1f} s: no joint comes "
            f"farther than motion_distance = {robot.motion_distance:g} rad from where it stood"
        )
    return motion


def _on_ticks(
    samples: Trajectory,
    robot: RobotSettings,
    motion: Motion | None,
    window: Window,
    notes: tuple[str, ...],
) -> ShownMotion:
    """Return the states at the ticks of the part that is imitated."""
    times = samples.stamps - samples.stamps[0]
    if motion is not None:
        begin, end = motion.begin, motion.end
    else:
        begin, end = window or (0.0, float(times[-1]))
    begin, horizon = _extent(begin, end, float(times[-1]), robot, motion)
    places = unwrapped(samples.positions, robot.joints, robot.continuous_joints)
    ticks = begin + robot.control_period * np.arange(horizon + 1)
    states = resample(times, places, samples.velocities, ticks)
    left = end - ticks[-1]
    if left > _ROUNDING * robot.control_period:
        notes = (*notes, f"its last {left:.2f} s, less than a control_period, are left out")
    controls = np.full((horizon, len(robot.roles.commanded)), np.nan)
    return ShownMotion(Rollout(states, controls), samples, motion, begin, notes)


def _extent(
    begin: float, end: float, recorded: float, robot: RobotSettings, motion: Motion | None
) -> tuple[float, int]:
    """Return where x[0] is [s] and how many decisions follow.

    Raises:
        UnfitDemonstrationError: the horizon that is set does not fit.
    """
    period = robot.control_period
    periods = (end - begin) / period
    # All of a motion, for behind it the robot stands; of a window no more than was asked for.
    needed = int(np.ceil(periods - _ROUNDING) if motion else np.floor(periods + _ROUNDING))
    if robot.horizon == 0:
        if needed < 1:
            raise UnfitDemonstrationError(
                f"its {end - begin:.2f} s are shorter than a control_period, {period:g} s"
            )
        return begin, needed
    horizon, longest = robot.horizon, robot.horizon * period
    what = motion.sentence() if motion else f"{end - begin:.1f} s to imitate"
    refusal = UnfitDemonstrationError(
        f"the horizon of {horizon} decisions takes {longest:g} s, but it shows {what}: set horizon "
        f"to 0 or {needed}, or name a part by demonstration_window"
    )
    if needed > horizon + 1:
        raise refusal
    last = recorded if motion else end
    if begin + longest > last + (1.0 + _ROUNDING) * period:  # it may be held for a period
        begin = recorded - longest
        if motion is None or begin < -_ROUNDING * period:
            raise refusal
    return max(0.0, begin), horizon
