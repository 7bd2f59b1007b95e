"""Where the object is now, by what was last heard on object_pose."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from irlpilco_ros.experience.object_pose import OBJECT_POSE, decode_pose
from irlpilco_ros.kinematics.rigid_motion import difference
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.ros.qos import OBJECT_POSE_SUBS
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription

_COUNT = 20
_SAME_PLACE = np.repeat([0.02, 0.1], 3)
"""Readings that differ by less, in x, y, z [m] and about each axis [rad], are of one place."""


@dataclass(frozen=True)
class SeenPose:
    """A message on object_pose.

    Attributes:
        data: Its bytes (CDR).
        matrix: The pose, (4, 4).
        received: When it came [ns], wall clock.
        sent: When it was sent [ns], the sender's wall clock.
    """

    data: bytes
    matrix: Array
    received: int
    sent: int


class ObjectWatch:
    """Listens to object_pose, and remembers.

    Attributes:
        last: The last pose that was heard; None before the first.
    """

    def __init__(self, node: Node, take: Callable[[SeenPose], None] | None = None) -> None:
        """Listen.

        Args:
            node: Who listens.
            take: Called with each pose.
        """
        self.last: SeenPose | None = None
        self._node = node
        self._seen: deque[Array] = deque(maxlen=_COUNT)
        self._heard: deque[tuple[int, bytes]] = deque(maxlen=_COUNT)
        self._take = take
        self._subscriptions = [
            SafeSubscription(node, PoseStamped, OBJECT_POSE, self._on_pose, qos)
            for qos in OBJECT_POSE_SUBS
        ]

    @property
    def topic_name(self) -> str:
        """The topic's full name."""
        return self._subscriptions[0].topic_name

    @property
    def is_told(self) -> bool:
        """Whether anybody publishes where the object is."""
        return bool(self._node.count_publishers(self.topic_name))

    @property
    def fault(self) -> str:
        """Why the last message that could not be used could not; empty if there was none."""
        return next((each.fault for each in self._subscriptions if each.fault), "")

    @property
    def readings(self) -> Array | None:
        """The last readings of this place (n, 4, 4); None if none was heard."""
        if self.last is None:
            return None
        off = np.abs(difference(self.last.matrix, np.stack(self._seen)))
        here: Array = np.stack(self._seen)[(off <= _SAME_PLACE).all(axis=1)]
        return here

    def catch_up(self) -> None:
        """Hear what has come meanwhile, before it is asked where the object is."""
        for each in self._subscriptions:
            each.drain()

    def _on_pose(self, data: bytes, info: Info) -> None:
        once = (info["source_timestamp"], data)
        if once in self._heard:
            return  # it came by another subscription
        self._heard.append(once)
        matrix = decode_pose(data)
        self.last = SeenPose(data, matrix, info["received_timestamp"], info["source_timestamp"])
        self._seen.append(matrix)
        if self._take is not None:
            self._take(self.last)
