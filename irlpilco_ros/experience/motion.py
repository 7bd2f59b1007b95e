"""Where in a recording the robot moves: whoever records it stands before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting

# Speeds are measured over this time [s]: within it sensor noise moves a joint by next to nothing.
_WINDOW = 0.25


@dataclass(frozen=True)
class MotionSettings:
    """What counts as motion.

    Raises:
        InvalidSettingError: a value is out of its range.
    """

    cut_to_motion: bool = setting(
        True,
        "Whether what stands still before and after the motion of a demonstration is left out.",
    )
    motion_speed: float = setting(
        0.01,
        "Speed of the fastest joint from which on a robot moves; above what sensor noise pretends "
        "over 0.25 s.",
        unit="rad/s",
        minimum=1e-4,
        maximum=10.0,
    )
    motion_distance: float = setting(
        0.005,
        "How far from where it stood a joint must come for a motion to have begun, and how near "
        "to where it ends for it to be over; above the noise of measured positions.",
        unit="rad",
        minimum=1e-5,
        maximum=10.0,
    )

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True)
class Motion:
    """From its onset to its end, within a recording.

    Attributes:
        begin: Time of the onset since the first sample, that of a sample [s].
        end: Time of the end since the first sample, that of a sample [s].
        recorded: Time from the first sample to the last [s].
        first_joint: Joint that moves first.
        last_joint: Joint that moves last.
    """

    begin: float
    end: float
    recorded: float
    first_joint: str
    last_joint: str

    @property
    def duration(self) -> float:
        """Time from onset to end [s]."""
        return self.end - self.begin

    def sentence(self) -> str:
        """Say when it begins and ends."""
        return (
            f"{self.duration:.1f} s of motion, from {self.begin:.1f} s to {self.end:.1f} s of "
            f"{self.recorded:.1f} s; first joint to move: {self.first_joint}, last: "
            f"{self.last_joint}"
        )


def find_motion(
    times: Array,
    positions: Array,
    joints: Sequence[str],
    settings: MotionSettings,
    continuous: Sequence[str] = (),
) -> Motion | None:
    """Return the motion in a recording, or None if nothing moves.

    A motion begins before a joint is `motion_distance` away from where it stood at first, where
    the robot was last slower than `motion_speed`; it ends likewise, seen from the end. Pauses in
    between belong to it.

    Args:
        times: Time of each sample (n,), rising [s].
        positions: Joint positions (n, J), finite [rad].
        joints: Names of the joints (J).
        settings: What counts as motion.
        continuous: Those of the joints that turn without end: a wrap at ±pi is no motion.
    """
    if len(times) < 2:
        return None
    places = unwrapped(positions, joints, continuous)
    onset = _onset(times, places, settings)
    if onset is None:
        return None
    # The end is the onset of the same recording played backwards.
    end = _onset(times[-1] - times[::-1], places[::-1], settings)
    if end is None:  # it only seemed to move, within twice the distance
        return None
    return Motion(
        begin=float(times[onset.sample] - times[0]),
        end=float(times[len(times) - 1 - end.sample] - times[0]),
        recorded=float(times[-1] - times[0]),
        first_joint=joints[onset.joint],
        last_joint=joints[end.joint],
    )


def unwrapped(positions: Array, joints: Sequence[str], continuous: Sequence[str]) -> Array:
    """Return positions (n, J) [rad] without the wraps at ±pi of the joints that turn without end.

    Exactly the same numbers where nothing wraps.
    """
    turning = [column for column, joint in enumerate(joints) if joint in continuous]
    if not turning:
        return positions
    turns = np.zeros_like(positions)
    steps = np.diff(positions[:, turning], axis=0)
    turns[1:, turning] = -np.cumsum(np.rint(steps / (2.0 * np.pi)), axis=0)
    return positions + 2.0 * np.pi * turns


@dataclass(frozen=True)
class _Onset:
    """Sample of an onset, and the joint (column) that moves first."""

    sample: int
    joint: int


def _onset(times: Array, positions: Array, settings: MotionSettings) -> _Onset | None:
    """Return where a robot that stood begins to move."""
    at_rest = np.median(positions[times <= times[0] + _WINDOW], axis=0)
    away = np.abs(positions - at_rest)
    beyond = np.flatnonzero((away > settings.motion_distance).any(axis=1))
    if not len(beyond):
        return None
    sample = int(beyond[0])
    joint = int(away[sample].argmax())
    while sample > 0 and _speed_before(times, positions, sample) > settings.motion_speed:
        sample -= 1
    return _Onset(_last_at_rest(times, positions, sample, int(beyond[0]), settings), joint)


def _last_at_rest(
    times: Array, positions: Array, sample: int, moving: int, settings: MotionSettings
) -> int:
    """Return the last sample before `moving` at which the robot stands as around `sample`."""
    around = (times <= times[sample]) & (times >= times[sample] - _WINDOW)
    way = np.abs(positions[sample : moving + 1] - np.median(positions[around], axis=0))
    gone = np.flatnonzero((way > settings.motion_speed * _WINDOW).any(axis=1))
    return sample + max(0, int(gone[0]) - 1) if len(gone) else sample


def _speed_before(times: Array, positions: Array, sample: int) -> float:
    """Return the speed of the fastest joint over the window before a sample [rad/s]."""
    # Stamps around 1e9 s are exact to a microsecond only.
    before = int(np.searchsorted(times, times[sample] - _WINDOW + 1e-6, side="right")) - 1
    before = min(max(before, 0), sample - 1)
    way = np.abs(positions[sample] - positions[before]).max()
    return float(way / (times[sample] - times[before]))
