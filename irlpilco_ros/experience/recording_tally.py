"""What a recording holds, counted while it is made: nothing is read back from disk for it."""

from __future__ import annotations

from array import array

import numpy as np

from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS
from irlpilco_ros.experience.trajectory import missing_in


class RecordingTally:
    """Counts samples; eight bytes for each are all that it keeps."""

    def __init__(self) -> None:
        self._observed = array("q")
        self._decided = array("q")

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

    def summary(self) -> str:
        """Return how many samples there are, how many are missing, and how often they come."""
        observed, decided = np.array(self._observed, np.int64), np.array(self._decided, np.int64)
        stamps = np.union1d(observed, decided)
        missing = len(np.setdiff1d(decided, observed)) + missing_in(stamps / NANOSECONDS)
        line = f"{len(stamps)} samples, {missing} missing"
        if len(stamps) > 1:
            line += f", one every {np.median(np.diff(stamps)) / NANOSECONDS:.3f} s"
        return line
