"""The JointStates of one topic as columns: small, however many there are."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, Reading

_NAN = float("nan")


@dataclass
class _Rows:
    """The messages that name the same joints in the same order."""

    numbers: array[int] = field(default_factory=lambda: array("q"))
    positions: array[float] = field(default_factory=lambda: array("d"))
    velocities: array[float] = field(default_factory=lambda: array("d"))
    commands: array[float] = field(default_factory=lambda: array("d"))


class JointStateColumns:
    """All JointStates of a topic, in the order in which they were recorded.

    Attributes:
        malformed: What the first message is that is no JointState; empty if all are.
    """

    def __init__(self) -> None:
        self.malformed = ""
        self._stamps = array("q")
        self._places = array("q")
        self._rows: dict[tuple[str, ...], _Rows] = {}

    def append(self, place: int, message: JointStateMessage | Reading) -> None:
        """Add a message, the one at this place in the bag."""
        names = message.names
        rows = self._rows.setdefault(names, _Rows())
        rows.numbers.append(len(self._stamps))
        for column, values in (
            (rows.positions, message.positions),
            (rows.velocities, message.velocities),
            (rows.commands, message.command),
        ):
            if len(values) == len(names):
                column.frombytes(np.asarray(values, dtype=float).tobytes())
            else:
                column.extend((_NAN,) * len(names))
        self._stamps.append(message.stamp)
        self._places.append(place)

    def __len__(self) -> int:
        """Number of messages N."""
        return len(self._stamps)

    @property
    def stamps(self) -> NDArray[np.int64]:
        """header.stamp of every message (N,) [ns]."""
        return np.array(self._stamps, dtype=np.int64)

    @property
    def places(self) -> NDArray[np.int64]:
        """Place of every message in the bag (N,)."""
        return np.array(self._places, dtype=np.int64)

    @property
    def names(self) -> tuple[str, ...]:
        """All joints that are named, in the order in which they appear."""
        return tuple(dict.fromkeys(name for names in self._rows for name in names))

    def positions(self, joints: Sequence[str]) -> NDArray[np.float64]:
        """Return the positions (N, J) [rad], NaN where a message does not tell."""
        return self._table(joints, "positions")

    def velocities(self, joints: Sequence[str]) -> NDArray[np.float64]:
        """Return the velocities (N, J) [rad/s], NaN where a message does not tell."""
        return self._table(joints, "velocities")

    def commands(self, joints: Sequence[str]) -> NDArray[np.float64]:
        """Return velocities, or efforts where there are none, (N, J); NaN where not told."""
        return self._table(joints, "commands")

    def _table(self, joints: Sequence[str], column: str) -> NDArray[np.float64]:
        table = np.full((len(self), len(joints)), _NAN)
        for names, rows in self._rows.items():
            source = {name: i for i, name in enumerate(names)}
            told = [(i, source[joint]) for i, joint in enumerate(joints) if joint in source]
            if told:
                values = np.array(getattr(rows, column)).reshape(-1, len(names))
                targets, sources = map(list, zip(*told, strict=True))
                numbers = np.array(rows.numbers, dtype=np.int64)
                table[numbers[:, None], targets] = values[:, sources]
        return table
