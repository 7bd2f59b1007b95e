"""The paths of a run's trials against the path that was shown."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

from irlpilco_ros.experience.path_quality import (
    MotionPath,
    PathQuality,
    path_of,
    path_quality,
)
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.shown_motion import ShownMotion
from irlpilco_ros.learning.joints import Joints


class PathJudge:
    """Measures trials over their whole path; a demonstration is read when the first one comes."""

    def __init__(
        self,
        directory: RunDirectory,
        joints: Joints,
        shown: Sequence[ShownMotion],
        seconds: float,
        carried: bool = False,
    ) -> None:
        """Measure nothing yet.

        Args:
            directory: The run.
            joints: Joints of the learning problem.
            shown: What is to be imitated.
            seconds: How long it takes [s].
            carried: Whether it was carried over from where it was shown.
        """
        self._directory = directory
        self._joints = joints
        self._begins = [float(each.samples.stamps[0]) + each.begin for each in shown]
        self._seconds = seconds
        self._carried = [each.samples for each in shown] if carried else None

    def trial(self, bag: Path) -> PathQuality:
        """Return how a whole trial went, from its first command to its last.

        Raises:
            BagError: the bag cannot be read.
        """
        recorded = self._directory.read_path(bag)
        decided = recorded.stamps[recorded.commanded]
        path = path_of(recorded, self._joints, decided[0], decided[-1] - decided[0])
        return path_quality(path, self._shown, self._joints)

    def demonstration(self) -> PathQuality:
        """Return how the demonstration went; of several, the hardest.

        Raises:
            BagError: a bag cannot be read.
        """
        each = [path_quality(path, self._shown, self._joints) for path in self._shown]
        return max(each, key=lambda one: one.acceleration_max)

    @cached_property
    def _shown(self) -> list[MotionPath | None]:
        recorded = self._carried or self._directory.demonstration_paths()
        return [
            path_of(one, self._joints, begin, self._seconds)
            for one, begin in zip(recorded, self._begins, strict=True)
        ]
