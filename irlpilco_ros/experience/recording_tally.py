"""What a recording holds, counted while it is made: nothing is read back from disk for it."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS
from irlpilco_ros.experience.motion import Motion, MotionSettings, find_motion
from irlpilco_ros.experience.trajectory import missing_in

_TRACED = 4096  # states
_JITTER = 0.9  # of their period: states come sooner, too


class RecordingTally:
    """Counts samples, eight bytes for each, and keeps a trace of the motion of bounded size."""

    def __init__(
        self,
        joints: Sequence[str],
        continuous: Sequence[str] = (),
        motion: MotionSettings | None = None,
    ) -> None:
        """Count nothing yet.

        Args:
            joints: Recorded joints (J).
            continuous: Those of them that turn without end.
            motion: What counts as motion, and whether the rest is left out; None for the default.
        """
        self._joints = tuple(joints)
        self._continuous = tuple(continuous)
        self._settings = motion or MotionSettings()
        self._observed = array("q")
        self._decided = array("q")
        self._trace = np.empty((_TRACED, 1 + len(self._joints)))
        self._traced = 0
        self._step = 1  # [ns]
        self._begin = 0

    @property
    def samples(self) -> int:
        """Number of samples with a joint state."""
        return len(self._observed)

    def observe(self, stamp: int) -> None:
        """Count a sample with a joint state of this stamp [ns]."""
        self._observed.append(stamp)

    def decide(self, stamp: int) -> None:
        """Count a command that was decided on the joint state of this stamp [ns]."""
        self._decided.append(stamp)

    def trace(self, stamp: int, positions: NDArray[np.float64]) -> None:
        """Take note of where the joints were at a stamp [ns]: positions (J,) [rad].

        When the trace is full, every other state of it is forgotten, and so are later ones.
        """
        self._begin = self._begin or stamp
        since = stamp - self._begin
        if self._traced and since < self._trace[self._traced - 1, 0] + self._step:
            return
        if self._traced == _TRACED:
            self._traced = _TRACED // 2
            self._trace[: self._traced] = self._trace[::2].copy()
            self._step = round(_JITTER * np.median(np.diff(self._trace[: self._traced, 0])))
        self._trace[self._traced] = since, *positions
        self._traced += 1

    def motion(self) -> Motion | None:
        """Return the motion that the trace shows, or None if nothing moved."""
        trace = self._trace[: self._traced]
        times, positions = trace[:, 0] / NANOSECONDS, trace[:, 1:]
        return find_motion(times, positions, self._joints, self._settings, self._continuous)

    def summary(self) -> str:
        """Return how many samples there are, how many are missing, and what they show."""
        observed, decided = np.array(self._observed, np.int64), np.array(self._decided, np.int64)
        stamps = np.union1d(observed, decided)
        missing = len(np.setdiff1d(decided, observed)) + missing_in(stamps / NANOSECONDS)
        line = f"{len(stamps)} samples, {missing} missing"
        if len(stamps) > 1:
            line += f", one every {np.median(np.diff(stamps)) / NANOSECONDS:.3f} s"
        if not len(decided) and len(observed) > 1:
            line += f"; {self._shown()}"
        return line

    def _shown(self) -> str:
        """Return what is told of a demonstration."""
        motion = self.motion()
        if motion is None:
            return "nothing moved"
        whole = "" if self._settings.cut_to_motion else "; all of it counts (cut_to_motion is off)"
        return motion.sentence() + whole
