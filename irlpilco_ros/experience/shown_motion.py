"""From a recording to what is imitated: cut to the motion, at the control period.

What comes before and after the motion is left out, and the samples are brought to the times at
which the policy will decide, by their stamps; a sample's index is nowhere taken for time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from irlpilco_ros.experience.errors import UnfitDemonstrationError
from irlpilco_ros.experience.motion import Motion, MotionSettings, find_motion, unwrapped
from irlpilco_ros.experience.resampling import measured_velocities, resample
from irlpilco_ros.experience.smoothing import smoothed_states
from irlpilco_ros.experience.trajectory import PACE, Trajectory
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.rollout import Rollout

Window = tuple[float, ...]
"""Empty, or begin and end of what is imitated, since the first sample [s]."""

ROUNDING = 0.05
"""Part of a control period that may be left out at the end, or be missing there."""


@dataclass(frozen=True)
class Wanted:
    """What is to be made of a recording.

    Attributes:
        joints: Joints of the learning problem, in order.
        period: Control period [s].
        horizon: Number of decisions H; 0 for as many as the motion takes.
        motion: What counts as motion, and whether what comes before and after it is left out.
        window: What to take instead of the motion that is found.
    """

    joints: Joints
    period: float
    horizon: int = 0
    motion: MotionSettings = field(default_factory=MotionSettings)
    window: Window = ()


@dataclass(frozen=True)
class ShownMotion:
    """What a recording shows.

    Attributes:
        rollout: States at the control period; controls if a policy showed it.
        samples: The joints as they were recorded; velocities that were missing are there.
        motion: What moves in it; None if that was not looked for.
        begin: Time of x[0] since the first sample [s].
        notes: What its user should know.
    """

    rollout: Rollout
    samples: Trajectory
    motion: Motion | None
    begin: float
    notes: tuple[str, ...] = ()


def shown_motions(recorded: Sequence[Trajectory], wanted: Wanted) -> tuple[ShownMotion, ...]:
    """Return what recordings of one task show, all of one length.

    Raises:
        UnfitDemonstrationError: one cannot be imitated, or they take too different times.
        BagError: a joint was not recorded.
    """
    shown = [shown_motion(each, wanted) for each in recorded]
    steps = [each.rollout.steps for each in shown]
    if len(set(steps)) > 1:
        if max(steps) - min(steps) > 1:
            raise UnfitDemonstrationError(
                f"the demonstrations take {', '.join(map(str, steps))} control periods; show the "
                "task at one pace"
            )
        longest = dataclasses.replace(wanted, horizon=max(steps))
        shown = [shown_motion(each, longest) for each in recorded]
    return tuple(_beside(shown[0], each, wanted.joints) for each in shown)


def shown_motion(recorded: Trajectory, wanted: Wanted) -> ShownMotion:
    """Return what one recording shows.

    If the robot was commanded once per control period, the trial is taken as it is: it was shown
    by a policy.

    Raises:
        UnfitDemonstrationError: nothing moves, or window or horizon do not fit.
        BagError: a joint was not recorded, or the trial of a policy is not whole.
    """
    samples, notes = samples_of(recorded, wanted)
    if _is_trial(recorded, wanted):
        rollout = recorded.rollout(wanted.joints, wanted.horizon or None)
        first = recorded.stamps[recorded.commanded][0]
        return ShownMotion(rollout, samples, None, first - samples.stamps[0])
    if recorded.commanded.any():
        notes = (*notes, "its commands are not one per control_period, and are left out")
    motion = None
    if wanted.motion.cut_to_motion and not wanted.window:
        motion = _found_motion(samples, wanted)
    return _on_ticks(samples, wanted, motion, notes)


def samples_of(recorded: Trajectory, wanted: Wanted) -> tuple[Trajectory, tuple[str, ...]]:
    """Return the samples of the wanted joints, without commands, and notes about them.

    Velocities that were not recorded are computed from the positions.

    Raises:
        UnfitDemonstrationError: there are fewer than two samples, or one is not finite.
        BagError: a joint was not recorded.
    """
    names, whole = wanted.joints.names, recorded.observed
    columns = recorded.columns(names)
    if whole.sum() < 2:
        raise UnfitDemonstrationError(
            f"{whole.sum()} samples tell of {', '.join(names)}; expected one per control_period"
        )
    positions = recorded.positions[whole][:, columns]
    if not np.isfinite(positions).all():
        sample, joint = np.argwhere(~np.isfinite(positions))[0]
        raise UnfitDemonstrationError(
            f"{names[joint]} is at {positions[sample, joint]} rad in sample {sample}"
        )
    stamps, velocities = recorded.stamps[whole], recorded.velocities[whole][:, columns]
    velocities, notes = _filled(stamps, positions, velocities, wanted)
    nothing = np.full_like(positions, np.nan)
    return Trajectory(names, stamps, positions, velocities, nothing), notes


def within(samples: Trajectory, window: Window) -> Trajectory:
    """Return the samples in a window, with those that it begins and ends between.

    Raises:
        UnfitDemonstrationError: this is no window of the recording.
    """
    if not window:
        return samples
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
    part = slice(first, int(np.searchsorted(times, window[1])) + 1)
    arrays = ("stamps", "positions", "velocities", "commands")
    return dataclasses.replace(samples, **{name: getattr(samples, name)[part] for name in arrays})


def _is_trial(recorded: Trajectory, wanted: Wanted) -> bool:
    """Whether commands were decided once per control period."""
    decided = recorded.stamps[recorded.commanded]
    if wanted.window or not len(decided):
        return False
    usual = np.median(np.diff(decided)) if len(decided) > 1 else wanted.period
    return bool(abs(usual - wanted.period) < PACE * wanted.period)


def _filled(
    stamps: np.ndarray, positions: np.ndarray, velocities: np.ndarray, wanted: Wanted
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return velocities without holes, and a note about those that were computed."""
    names = wanted.joints.names
    places = unwrapped(positions, names, wanted.joints.continuous)
    absent = ~np.isfinite(velocities)
    # Drivers that know no speeds may publish zeros.
    moving = np.ptp(places, axis=0) > wanted.motion.motion_distance
    absent |= moving & ~np.where(absent, 0.0, velocities).any(axis=0)
    if not absent.any():
        return velocities, ()
    lacking = [name for name, holes in zip(names, absent.T, strict=True) if holes.any()]
    whose = "" if len(lacking) == len(names) else f" of {', '.join(lacking)}"
    note = f"velocities{whose} that were not recorded are computed from the positions"
    return np.where(absent, measured_velocities(stamps, places), velocities), (note,)


def _found_motion(samples: Trajectory, wanted: Wanted) -> Motion:
    motion = find_motion(
        samples.stamps,
        samples.positions,
        samples.joint_names,
        wanted.motion,
        wanted.joints.continuous,
    )
    if motion is None:
        raise UnfitDemonstrationError(
            f"nothing moves in its {samples.stamps[-1] - samples.stamps[0]:.1f} s: no joint comes "
            f"farther than motion_distance = {wanted.motion.motion_distance:g} rad from where it "
            "stood"
        )
    return motion


def _on_ticks(
    samples: Trajectory, wanted: Wanted, motion: Motion | None, notes: tuple[str, ...]
) -> ShownMotion:
    """Return the states at the ticks of the part that is imitated."""
    times = samples.stamps - samples.stamps[0]
    within(samples, wanted.window)  # refuses a window that is none
    begin, end = wanted.window or (0.0, float(times[-1]))
    if motion is not None:
        begin, end = motion.begin, motion.end
    begin, horizon = _extent(begin, end, float(times[-1]), wanted, motion)
    ticks = begin + wanted.period * np.arange(horizon + 1.0)
    states = states_at(samples, ticks, wanted.joints)
    left = end - ticks[-1]
    if left > ROUNDING * wanted.period:
        notes = (*notes, f"its last {left:.2f} s, less than a control_period, are left out")
    controls = np.full((horizon, len(wanted.joints.commanded)), np.nan)
    return ShownMotion(Rollout(states, controls), samples, motion, begin, notes)


def states_at(samples: Trajectory, ticks: np.ndarray, joints: Joints) -> np.ndarray:
    """Return the states (m, 2J) at times (m,) since the first sample [s].

    By all samples around a tick where they are dense enough, else by those beside it.
    """
    times = samples.stamps - samples.stamps[0]
    places = unwrapped(samples.positions, samples.joint_names, joints.continuous)
    states = resample(times, places, samples.velocities, ticks)
    smooth = smoothed_states(times, places, samples.velocities, ticks)
    return np.where(np.isfinite(smooth), smooth, states)


def _extent(
    begin: float, end: float, recorded: float, wanted: Wanted, motion: Motion | None
) -> tuple[float, int]:
    """Return where x[0] is [s] and how many decisions follow.

    Raises:
        UnfitDemonstrationError: the horizon that is set does not fit.
    """
    period, periods = wanted.period, (end - begin) / wanted.period
    # All of a motion, for behind it the robot stands; of a window no more than was asked for.
    needed = int(np.ceil(periods - ROUNDING) if motion else np.floor(periods + ROUNDING))
    if needed < 1:
        raise UnfitDemonstrationError(
            f"its {end - begin:.2f} s are shorter than a control_period, {period:g} s"
        )
    if wanted.horizon == 0:
        return begin, needed
    longest = wanted.horizon * period
    what = motion.sentence() if motion else f"{end - begin:.1f} s to imitate"
    refusal = UnfitDemonstrationError(
        f"the horizon of {wanted.horizon} decisions takes {longest:g} s, but it shows {what}: set "
        f"horizon to 0 or {needed}, or name a part by demonstration_window"
    )
    if needed > wanted.horizon + 1:
        raise refusal
    last = recorded if motion else end
    if begin + longest > last + (1.0 + ROUNDING) * period:  # it may be held for a period
        begin = recorded - longest
        if motion is None or begin < -ROUNDING * period:
            raise refusal
    return max(0.0, begin), wanted.horizon


def _beside(first: ShownMotion, other: ShownMotion, joints: Joints) -> ShownMotion:
    """Return what was shown with joints that turn without end at the same turn as the first."""
    angles = [joints.names.index(name) for name in joints.continuous]
    states = other.rollout.states.copy()
    ahead = states[0, angles] - first.rollout.states[0, angles]
    states[:, angles] -= 2.0 * np.pi * np.rint(ahead / (2.0 * np.pi))
    return dataclasses.replace(other, rollout=Rollout(states, other.rollout.controls))
