"""Joint states as they come, merged by name: messages may be partial, longer or reordered.

A real Baxter sends 17 names in alphabetical order and, between them, single grippers. No ROS here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.learning.errors import IrlPilcoError

RESTART = 0.5
"""Stamps that run back by this much are those of a robot or a clock that was set anew [s]."""

_RESTART_AFTER = 1.5  # [s]: stamps that have been behind for so long are the new ones

_NEVER = -(2**62)  # [ns]: no stamp yet


class MalformedJointStateError(IrlPilcoError, ValueError):
    """A joint state's lists do not fit each other."""


@dataclass(frozen=True)
class JointReading:
    """State of all wanted joints at one stamp.

    Attributes:
        stamp: Stamp of the newest message in it [ns].
        positions: (J,) [rad], in the order of the wanted joints.
        velocities: (J,) [rad/s].
        efforts: (J,) [Nm], NaN where none is told; empty if nobody asked.
    """

    stamp: int
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    efforts: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))

    @property
    def state(self) -> NDArray[np.float64]:
        """[positions, velocities] (2J,)."""
        return np.concatenate([self.positions, self.velocities])


class JointStateTracker:
    """Merges joint states by name and knows how old each joint's values are.

    A joint is alive as long as its stamps advance: a driver that goes on sending one and the same
    stamp, or stamps that run back by little, tells nothing new. When a stamp came is counted on
    the caller's steady clock. Values are taken from every message, whatever its stamp.
    """

    def __init__(self, joints: Sequence[str]) -> None:
        """Follow these joints."""
        self.joints = tuple(joints)
        self._index = {joint: i for i, joint in enumerate(self.joints)}
        self._positions = np.full(len(self.joints), np.nan)
        self._velocities = np.full(len(self.joints), np.nan)
        self._efforts = np.full(len(self.joints), np.nan)
        self._arrival = np.full(len(self.joints), -math.inf)
        self._advance = np.full(len(self.joints), -math.inf)
        self._newest = np.full(len(self.joints), _NEVER)
        self._ran_back = 0.0

    @property
    def stamp(self) -> int | None:
        """The newest stamp of all wanted joints [ns], or None before the first message."""
        newest = int(self._newest.max())
        return None if newest == _NEVER else newest

    @property
    def ran_back(self) -> float:
        """How far the last message's stamp lay behind one before it of the same joint [s]."""
        return self._ran_back

    def update(self, message: JointStateMessage, arrival: float) -> bool:
        """Take in one message.

        A stamp that runs back by RESTART or more begins anew: the robot or its clock was reset.
        So does any earlier stamp where none has advanced for longer than a motion could last.

        Args:
            message: The message.
            arrival: When it came [s], on a steady clock.

        Returns:
            True if it holds wanted joints and bears a later stamp than any before it, or begins
            anew: a new state. Any other stamp, or a message without wanted joints, is none.

        Raises:
            MalformedJointStateError: it names wanted joints but its lists differ in length.
        """
        places = [
            (i, self._index[name]) for i, name in enumerate(message.names) if name in self._index
        ]
        if not places:
            return False
        counts = (len(message.names), len(message.positions), len(message.velocities))
        if len(set(counts)) != 1:
            raise MalformedJointStateError(
                f"joint state has {counts[0]} names, {counts[1]} positions and {counts[2]} "
                "velocities; expected as many of each"
            )
        targets = np.array([target for _, target in places])
        for source, target in places:
            self._positions[target] = message.positions[source]
            self._velocities[target] = message.velocities[source]
            # Efforts are a bonus: a robot may tell none, or too few to know whose they are.
            is_told = len(message.efforts) == len(message.names)
            self._efforts[target] = message.efforts[source] if is_told else np.nan
        self._arrival[targets] = arrival
        return self._take_stamp(targets, message.stamp, arrival)

    def _take_stamp(self, targets: NDArray[np.intp], stamp: int, arrival: float) -> bool:
        before = self.stamp
        back = int(self._newest[targets].max()) - stamp
        self._ran_back = max(0.0, back * 1e-9) if before is not None else 0.0
        overdue = arrival - float(self._advance[targets].max()) > _RESTART_AFTER
        if self._ran_back >= RESTART or (self._ran_back > 0.0 and overdue):
            self._newest[self._newest != _NEVER] = stamp
            self._advance[targets] = arrival
            return True
        later = targets[self._newest[targets] < stamp]
        self._newest[later] = stamp
        self._advance[later] = arrival
        return before is None or stamp > before

    def missing(self) -> tuple[str, ...]:
        """Return the wanted joints that were never heard of."""
        return self._named(np.isneginf(self._arrival))

    def silent(self, now: float, timeout: float) -> tuple[str, ...]:
        """Return the wanted joints that were not heard of for `timeout` [s] or ever."""
        return self._named(now - self._arrival > timeout)

    def stuck(self, now: float, timeout: float) -> tuple[str, ...]:
        """Return the wanted joints whose stamp has not advanced for `timeout` [s] or ever."""
        return self._named(now - self._advance > timeout)

    def behind(self, time: int, timeout: float) -> tuple[str, ...]:
        """Return the wanted joints whose stamp is `timeout` [s] or more behind a time [ns]."""
        return self._named((time - self._newest) * 1e-9 > timeout)

    def reading(self) -> JointReading | None:
        """Return the newest state, or None as long as a wanted joint is missing."""
        if self.stamp is None or self.missing():
            return None
        return JointReading(
            self.stamp, self._positions.copy(), self._velocities.copy(), self._efforts.copy()
        )

    def _named(self, chosen: NDArray[np.bool_]) -> tuple[str, ...]:
        return tuple(joint for joint, wanted in zip(self.joints, chosen, strict=True) if wanted)
