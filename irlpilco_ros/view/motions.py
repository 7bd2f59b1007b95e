"""What is shown of a run or a bag: motions over time beside what they imitate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_reader import read_path
from irlpilco_ros.experience.best_trial import best_row
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.metrics import REPLAY, MetricsRow
from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.experience.places import Place, read_places
from irlpilco_ros.experience.predicted_band import PredictedBand
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.shown_motion import ShownMotion, shown_motions
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.report.courses import course, course_of_trial
from irlpilco_ros.report.read_run import run_joints, run_wanted

AS_SHOWN = "as shown"
"""The place where a motion was shown."""


@dataclass(frozen=True)
class Course:
    """One motion, and what it imitates.

    Attributes:
        times: Since it began (n,), rising [s].
        positions: Of the joints (n, J) [rad].
        wanted: What was shown, at the same times (n, J) [rad]; None if nothing was.
        band_times: Times of the decisions (H + 1,) [s]; empty without a prediction.
        band: Predicted positions and their standard deviations (2, H + 1, J) [rad].
        object_pose: Where the object was (4, 4) [m]; None if it was where it was shown.
    """

    times: Array
    positions: Array
    wanted: Array | None
    band_times: Array
    band: Array
    object_pose: Array | None = None

    @property
    def error(self) -> Array:
        """How far each joint is from what was shown (n, J) [rad]; nothing shown: zero."""
        return (
            np.zeros_like(self.positions) if self.wanted is None else self.positions - self.wanted
        )


@dataclass(frozen=True)
class Entry:
    """A motion that can be chosen.

    Attributes:
        name: Such as "iteration 3".
        place: Where the object was.
        read: Returns it; from disk, the first time.
    """

    name: str
    place: str
    read: Callable[[], Course]


@dataclass(frozen=True)
class Motions:
    """All that can be looked at.

    Attributes:
        title: What it is.
        joints: The robot's joints, in the order of the columns.
        entries: The motions, at least one.
        first: Which of them is shown first.
    """

    title: str
    joints: tuple[str, ...]
    entries: tuple[Entry, ...]
    first: int

    @property
    def places(self) -> tuple[str, ...]:
        """The places, in order."""
        return tuple(dict.fromkeys(entry.place for entry in self.entries))


def motions_of_bag(bag: Path, topic: str = "") -> Motions:
    """Return the motion in a bag.

    Raises:
        BagError: it cannot be read, or tells of nothing.
    """
    recorded = read_path(bag, topic)
    told = recorded.observed
    if told.sum() < 2:
        raise BagError(f"{bag} tells where the joints are {told.sum()} times; expected a motion")
    times, positions = recorded.stamps[told], recorded.positions[told]
    whole = Course(times - times[0], positions, None, np.empty(0), np.empty((2, 0, 0)))
    entry = Entry(bag.name, AS_SHOWN, lambda: whole)
    return Motions(str(bag), recorded.joint_names, (entry,), 0)


def motions_of_run(path: Path) -> Motions:
    """Return the motions of a run.

    Raises:
        RunDirectoryError: it is none, or holds no judged trial yet.
        BagError: its demonstration cannot be read.
    """
    run = RunDirectory(path)
    configuration = run.configuration()
    try:
        joints = run_joints(configuration)
        wanted = run_wanted(configuration, joints)
    except InvalidSettingError as error:
        raise RunDirectoryError(f"{run.configuration_file}: {error}") from error
    rows = run.metrics()
    if not rows:
        raise RunDirectoryError(
            f"{path} holds no judged trial yet; there is nothing to see before the first trial"
        )
    shown = shown_motions(run.demonstrations(), wanted)[0]
    reader = _RunReader(run, joints, wanted.period, shown, read_places(run.places_directory))
    entries = [reader.entry(row) for row in rows]
    replay = run.baseline_metrics(REPLAY)
    if replay is not None:
        entries.insert(0, reader.replay(replay))
    best = best_row(rows)
    names = [entry.name for entry in entries]
    first = names.index(_name(best)) if best is not None else len(entries) - 1
    return Motions(str(path), joints.names, tuple(entries), first)


class _RunReader:
    """Reads the motions of one run as they are asked for."""

    def __init__(
        self,
        run: RunDirectory,
        joints: Joints,
        period: float,
        shown: ShownMotion,
        places: list[Place],
    ) -> None:
        self._run, self._joints, self._period = run, joints, period
        self._shown, self._places = shown, places
        self._wanted = cache(self._read_wanted)

    def entry(self, row: MetricsRow) -> Entry:
        number = self._place_of(row.iteration or 0)
        place = AS_SHOWN
        if number:
            place = f"place {number}: {_where(self._places[number - 1])}"
        bag = self._run.trials_directory / f"{row.trial:03d}"
        return Entry(_name(row), place, cache(lambda: self._read(bag, number, row.iteration)))

    def replay(self, row: MetricsRow) -> Entry:
        bag = self._run.replay_directory / f"{row.trial:03d}"
        return Entry("replay", AS_SHOWN, cache(lambda: self._read(bag, 0, None)))

    def _place_of(self, iteration: int) -> int:
        """Return the number of the place of an iteration's trial; 0 is where it was shown."""
        numbers = [k for k, place in enumerate(self._places, 1) if place.first <= iteration]
        number = max(numbers, default=0)
        return number if number and self._places[number - 1].shown else 0

    def _read(self, bag: Path, place: int, iteration: int | None) -> Course:
        path = course_of_trial(self._run.read_path(bag), self._joints)
        if path is None:  # the states at the decisions are all that was recorded
            shown = self._places[place - 1].shown[0] if place else self._shown
            states = self._run.read_trial(bag, self._joints, shown.rollout.steps).states
            path = self._at_decisions(states)
        reference = self._wanted(place)
        columns = [
            np.interp(path.times, reference.times, column) for column in reference.positions.T
        ]
        band = None
        if iteration and iteration in self._run.iterations():
            band = PredictedBand.of(self._run.read_iteration(iteration), self._joints)
        count = 0 if band is None else len(band.positions)
        return Course(
            path.times,
            path.positions,
            np.stack(columns, axis=1),
            self._period * np.arange(count, dtype=float),
            np.empty((2, 0, 0)) if band is None else np.stack([band.positions, band.deviations]),
            self._places[place - 1].object_pose if place else None,
        )

    def _read_wanted(self, place: int) -> MotionPath:
        """Return what is imitated at a place."""
        if place:
            shown = self._places[place - 1].shown[0]
            recorded = shown.samples
        else:
            shown, recorded = self._shown, self._run.demonstration_paths()[0]
        begin = float(shown.samples.stamps[0]) + shown.begin
        states = shown.rollout.states
        seconds = self._period * (len(states) - 1)
        return course(recorded, self._joints, begin, seconds) or self._at_decisions(states)

    def _at_decisions(self, states: Array) -> MotionPath:
        count = len(self._joints.names)
        times = self._period * np.arange(len(states), dtype=float)
        return MotionPath(times, states[:, :count], states[:, count:])


def _where(place: Place) -> str:
    """Say where the object is at a place, and how fast the motion is done there."""
    words = []
    if place.object_pose is not None:
        x, y = place.object_pose[:2, 3]
        words.append(f"object at {x:.3f}, {y:.3f} m")
    if place.speed != 1.0:
        words.append(f"{place.speed:g} times as fast as shown")
    return ", ".join(words)


def _name(row: MetricsRow) -> str:
    return f"iteration {row.iteration}" if row.iteration else "first trial"
