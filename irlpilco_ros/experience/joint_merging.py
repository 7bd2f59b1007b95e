"""Joint states merged by name while they come: what is whole, what is stale, what falls silent.

Messages may tell some of the joints only, and publishers may be milliseconds apart. What is late
is counted in the time of the stamps, so that neither a fast simulation nor a busy computer matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS

_RESET = NANOSECONDS  # stamps that jump back by more than this are another clock's [ns]
_SILENCE = NANOSECONDS // 2  # no joint that is told within this falls silent [ns]
_UNSYNCHRONISED = NANOSECONDS // 50  # two computers' clocks may differ by so much [ns]
_TOGETHER = 0.6  # what belongs together lies closer together than this many periods
_FROZEN = 50  # so many messages of one stamp that tell of motion: the stamps stand still
_LONGEST_LIST = 100  # silences that are remembered


@dataclass(frozen=True, slots=True)
class Received:
    """A joint state or command as it came over the wire.

    Attributes:
        stamp: header.stamp [ns].
        names: Joints (n) that it tells or commands.
        positions: As many as it tells [rad].
        velocities: As many as it tells [rad/s].
        data: Its bytes (CDR).
        received: When it came [ns], wall clock.
        sent: When it was sent [ns], the sender's wall clock.
    """

    stamp: int
    names: tuple[str, ...]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    data: bytes
    received: int
    sent: int


@dataclass(frozen=True, slots=True)
class Moment:
    """What was last told of all joints when a message came.

    Attributes:
        stamp: Stamp of that message [ns].
        parts: Messages that tell all joints, in the order in which they came.
        whole: Whether every joint was told anew since the last whole moment, and all together.
    """

    stamp: int
    parts: tuple[Received, ...]
    whole: bool


@dataclass(frozen=True)
class Silence:
    """A time in which joints were not told of.

    Attributes:
        joints: Which ones.
        begin: Stamp of the last message that told of them [ns].
        end: Stamp of the next one [ns], or None if there was none.
    """

    joints: tuple[str, ...]
    begin: int
    end: int | None


@dataclass(frozen=True)
class _Source:
    """Which of the wanted joints messages with certain names tell, and where."""

    columns: NDArray[np.intp]
    joints: NDArray[np.intp]


class JointMerger:
    """Merges the joint states of a stream by name.

    Attributes:
        positions: What was last told of each joint, (J,) [rad], NaN if nothing was.
        velocities: The same, (J,) [rad/s].
        silences: Times in which joints were not told of, but then were again.
        unusable: Joint -> why what was last told of it cannot be used.
        accepted: Number of messages that held something new of wanted joints.
        apart: How far apart [ns] what was last told of the joints is.
    """

    def __init__(self, joints: Sequence[str], period: int) -> None:
        """Merge messages that tell of these joints.

        Args:
            joints: The wanted joints (J).
            period: Time between samples [ns]; who reads them takes what lies closer together than
                a part of it for one.
        """
        self.joints = tuple(joints)
        count = len(self.joints)
        self.positions = np.full(count, np.nan)
        self.velocities = np.full(count, np.nan)
        self.silences: list[Silence] = []
        self.unusable: dict[str, str] = {}
        self._period = period
        self._index = {joint: i for i, joint in enumerate(self.joints)}
        self._sources: dict[tuple[str, ...], _Source] = {}
        self._stamps = np.zeros(count, np.int64)  # 0 as long as nothing was told
        self._periods = np.full(count, np.nan)
        self._fresh = np.zeros(count, bool)
        self._parts: list[Received | None] = [None] * count
        self._arrivals = np.zeros(count, np.int64)
        self.accepted = 0
        self.apart = 0
        self._frozen = 0

    @property
    def missing(self) -> tuple[str, ...]:
        """Joints of which no message has told yet."""
        return self._named(self._stamps == 0)

    @property
    def newest(self) -> int:
        """Newest stamp of a wanted joint [ns], 0 if there is none."""
        return int(self._stamps.max())

    @property
    def without_velocities(self) -> tuple[str, ...]:
        """Joints whose velocity was not told, or is no number, in their last message."""
        return self._named(~np.isfinite(self.velocities))

    def silent(self) -> tuple[Silence, ...]:
        """Return which joints are not told of any more while others are."""
        limits = np.maximum(_SILENCE, 3.0 * np.nan_to_num(self._periods))
        late = (self._stamps.max() - self._stamps > limits) & (self._stamps > 0)
        return self._silences(late, None)

    def take(self, state: Received) -> Moment | None:
        """Take in a joint state.

        Returns:
            What is known then of all joints. None if it holds nothing new of the wanted joints, a
            joint was not told of yet, or what was told of one is stale.

        Raises:
            BagError: the stamps jump back, as when a simulation is reset, or stand still.
        """
        source = self._sources.get(state.names) or self._learn(state.names)
        told, columns = source.joints, source.columns
        if not len(told) or not self._has_stamp(state, told):
            return None
        if len(state.positions) != len(state.names):
            self._refuse(told, f"{len(state.names)} names, {len(state.positions)} positions")
            return None
        positions = state.positions[columns]
        useful = np.isfinite(positions) & self._is_new(state.stamp, told, positions)
        if not useful.all():
            self._refuse(told[~np.isfinite(positions)], "not finite")
            told, columns, positions = told[useful], columns[useful], positions[useful]
            if not len(told):
                return None
        self._note_intervals(state.stamp, told)
        self._stamps[told] = state.stamp
        self.positions[told] = positions
        complete = len(state.velocities) == len(state.names)
        self.velocities[told] = state.velocities[columns] if complete else np.nan
        if self.unusable:
            for joint in self._named_at(told):
                self.unusable.pop(joint, None)
        return self._moment(state, told)

    def _learn(self, names: tuple[str, ...]) -> _Source:
        places = [(i, self._index[name]) for i, name in enumerate(names) if name in self._index]
        columns, joints = np.array(places, np.intp).reshape(-1, 2).T
        self._sources[names] = _Source(columns.copy(), joints.copy())
        return self._sources[names]

    def _has_stamp(self, state: Received, told: NDArray[np.intp]) -> bool:
        """Whether a message bears a stamp; none is 0, which ROS takes for "no time yet"."""
        if state.stamp <= 0:
            self._refuse(told, f"the stamp {state.stamp / NANOSECONDS:.3f} s, which is none")
            return False
        return True

    def _refuse(self, told: NDArray[np.intp], reason: str) -> None:
        self.unusable.update(dict.fromkeys(self._named_at(told), reason))

    def _is_new(
        self, stamp: int, told: NDArray[np.intp], positions: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Return for which joints a message is newer than what is known."""
        before = self._stamps[told]
        newer: NDArray[np.bool_] = before < stamp
        if newer.all():
            self._frozen = 0
            return newer
        newest = int(before.max())
        if stamp < newest - _RESET:
            raise BagError(
                f"the stamps of joint_states jumped back from {newest / NANOSECONDS:.3f} "
                f"s to {stamp / NANOSECONDS:.3f} s; the robot's clock was reset"
            )
        if (positions != self.positions[told]).any():
            self._frozen += 1
            if self._frozen >= _FROZEN:
                raise BagError(
                    f"the stamps of joint_states do not advance beyond {newest / NANOSECONDS:.3f} "
                    "s while the joints move; without a time they make no motion"
                )
        return newer

    def _note_intervals(self, stamp: int, told: NDArray[np.intp]) -> None:
        """Learn how often joints are told of, and note for how long they were not."""
        before, periods = self._stamps[told], self._periods[told]
        intervals = np.where(before > 0, stamp - before, np.nan)
        known = np.where(np.isnan(periods), intervals, periods)
        late = intervals > np.maximum(_SILENCE, 3.0 * known)
        if late.any() and len(self.silences) < _LONGEST_LIST:
            everywhere = np.zeros(len(self.joints), bool)
            everywhere[told[late]] = True
            self.silences += self._silences(everywhere, stamp)
        # An interval of silence says little about how often a joint is told of.
        self._periods[told] = known + 0.2 * (np.minimum(intervals, 4.0 * known) - known)

    def _moment(self, state: Received, told: NDArray[np.intp]) -> Moment | None:
        self.accepted += 1
        self._arrivals[told] = self.accepted
        for joint in told:
            self._parts[joint] = state
        self._fresh[told] = True
        if len(told) == len(self.joints):
            self._fresh[:] = False
            return Moment(state.stamp, (state,), whole=True)
        if not self._stamps.all():
            return None
        spread = np.abs(state.stamp - self._stamps)
        self.apart = int(spread.max())
        # How old is old is known when each joint was told of twice; until then, hardly anything is.
        slowest = float(np.nan_to_num(self._periods.max()))
        whole = False
        if self._fresh.all():
            apart = max(_TOGETHER * slowest, min(_UNSYNCHRONISED, _TOGETHER * self._period))
            whole = bool(spread.max() <= apart)
            self._fresh[:] = False if whole else spread <= apart
        if not whole and spread.max() > max(2.0 * slowest, _UNSYNCHRONISED):
            return None
        parts = {int(self._arrivals[i]): part for i, part in enumerate(self._parts) if part}
        return Moment(state.stamp, tuple(parts[count] for count in sorted(parts)), whole)

    def _silences(self, which: NDArray[np.bool_], end: int | None) -> tuple[Silence, ...]:
        """Return one silence for all joints that were last told of at the same time."""
        return tuple(
            Silence(self._named(which & (self._stamps == begin)), int(begin), end)
            for begin in np.unique(self._stamps[which])
        )

    def _named(self, which: NDArray[np.bool_]) -> tuple[str, ...]:
        return self._named_at(np.flatnonzero(which))

    def _named_at(self, places: NDArray[np.intp]) -> tuple[str, ...]:
        return tuple(self.joints[i] for i in places)
