"""Joint states as they come, merged by name: messages may be partial, longer or reordered.

A real Baxter sends 17 names in alphabetical order and, between them, single grippers. No ROS here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.learning.errors import IrlPilcoError


class MalformedJointStateError(IrlPilcoError, ValueError):
    """A joint state's lists do not fit each other."""


@dataclass(frozen=True)
class JointReading:
    """State of all wanted joints at one stamp.

    Attributes:
        stamp: Stamp of the newest message in it [ns].
        positions: (J,) [rad], in the order of the wanted joints.
        velocities: (J,) [rad/s].
    """

    stamp: int
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]

    @property
    def state(self) -> NDArray[np.float64]:
        """[positions, velocities] (2J,)."""
        return np.concatenate([self.positions, self.velocities])


class JointStateTracker:
    """Merges joint states by name and knows how old each joint's values are.

    Freshness is counted from the arrival of messages on the caller's steady clock: in lockstep a
    waiting simulator repeats a state with an old stamp, and is alive.
    """

    def __init__(self, joints: Sequence[str]) -> None:
        """Follow these joints."""
        self.joints = tuple(joints)
        self._index = {joint: i for i, joint in enumerate(self.joints)}
        self._positions = np.full(len(self.joints), np.nan)
        self._velocities = np.full(len(self.joints), np.nan)
        self._arrival = np.full(len(self.joints), -math.inf)
        self._stamp: int | None = None

    def update(self, message: JointStateMessage, arrival: float) -> bool:
        """Take in one message.

        Args:
            message: The message.
            arrival: When it came [s], on a steady clock.

        Returns:
            True if it holds wanted joints and bears another stamp than the one before: a new
            state. A repeated stamp, or a message without wanted joints, is no new state.

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
        for source, target in places:
            self._positions[target] = message.positions[source]
            self._velocities[target] = message.velocities[source]
            self._arrival[target] = arrival
        is_new = message.stamp != self._stamp
        self._stamp = message.stamp
        return is_new

    def missing(self) -> tuple[str, ...]:
        """Return the wanted joints that were never heard of."""
        return self.silent(math.inf, math.inf)

    def silent(self, now: float, timeout: float) -> tuple[str, ...]:
        """Return the wanted joints that were not heard of for `timeout` [s] or ever."""
        never = np.isneginf(self._arrival)
        late = now - self._arrival > timeout if math.isfinite(timeout) else never
        return tuple(joint for joint, gone in zip(self.joints, never | late, strict=True) if gone)

    def reading(self) -> JointReading | None:
        """Return the newest state, or None as long as a wanted joint is missing."""
        if self._stamp is None or self.missing():
            return None
        return JointReading(self._stamp, self._positions.copy(), self._velocities.copy())
