"""Commanded but not moving: what pushes against something. No ROS here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.motions import MotionStoppedError

Vector = NDArray[np.float64]

STALL_SPEED = 0.1
"""A commanded speed that is well above zero [rad/s]: slower joints are not judged."""

_STALL_SHARE = 0.1  # of the commanded way: who goes less far has not moved


class StallGuard:
    """Judges each joint over stretches of time in which it is pushed one way without a break.

    What counts is how far apart the joint's positions of a stretch lie, not where it ends: a robot
    that runs behind its commands is still on its way back when it is sent forth.
    """

    def __init__(self, joints: Sequence[str]) -> None:
        """Judge these joints (F), which are commanded."""
        self._joints = tuple(joints)
        zeros = np.zeros(len(self._joints))
        self._stamp: int | None = None
        self._begin = np.zeros(len(self._joints), dtype=np.int64)
        self._side, self._pushed = zeros, zeros
        self._way, self._lowest, self._highest = zeros, zeros, zeros

    def check(self, stamp: int, positions: Vector, speeds: Vector, timeout: float) -> None:
        """Take in a state and what is commanded on it.

        Args:
            stamp: Of the state [ns].
            positions: (F,) [rad].
            speeds: (F,) commanded, without what merely holds the joint [rad/s].
            timeout: How long a joint may be pushed without moving [s].

        Raises:
            MotionStoppedError: a joint does not move; names it, its command and how far it went.
        """
        elapsed = 0.0 if self._stamp is None else (stamp - self._stamp) * 1e-9
        self._way = self._way + elapsed * np.abs(self._pushed)
        self._lowest = np.minimum(self._lowest, positions)
        self._highest = np.maximum(self._highest, positions)
        self._stamp, self._pushed = stamp, speeds
        side = np.where(np.abs(speeds) >= STALL_SPEED, np.sign(speeds), 0.0)
        over = (side != 0.0) & (side == self._side) & (stamp - self._begin >= timeout * 1e9)
        gone = self._highest - self._lowest
        for joint in np.flatnonzero(over & (gone < _STALL_SHARE * self._way)):
            raise MotionStoppedError(
                f"joint {self._joints[joint]} is commanded but does not move: in {timeout:g} s it "
                f"was to go {self._way[joint]:.4f} rad, and went {gone[joint]:.4f} rad; is "
                "something in its way?"
            )
        anew = over | (side != self._side) | (side == 0.0)
        self._side = side
        self._begin = np.where(anew, stamp, self._begin)
        self._way = np.where(anew, 0.0, self._way)
        self._lowest = np.where(anew, positions, self._lowest)
        self._highest = np.where(anew, positions, self._highest)
