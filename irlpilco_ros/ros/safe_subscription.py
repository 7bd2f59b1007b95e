"""A subscription that nothing on the wire can end the process by.

rclpy decodes a message before it calls anybody, and a payload that cannot be decoded ends the
executor. Here messages arrive as bytes; whoever takes them decodes them, and whatever goes wrong
with one message costs that message only.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile

from irlpilco_ros.learning.errors import IrlPilcoError

Info = Mapping[str, Any]
"""What rclpy knows about a message, such as received_timestamp [ns, wall clock]."""

_WARN_EVERY = 2.0  # [s]
_LONGEST_DRAIN = 1000  # messages


class SafeSubscription:
    """Hands each message of a topic, as CDR bytes, to a function that may fail.

    Attributes:
        refused: Number of messages that could not be used.
        fault: Why the last of them could not be used; empty if there was none.
    """

    def __init__(
        self,
        node: Node,
        message_type: type,
        topic: str,
        take: Callable[[bytes, Info], None],
        qos: QoSProfile,
    ) -> None:
        """Subscribe.

        Args:
            node: Who subscribes.
            message_type: Type of the topic's messages.
            topic: Its name, relative to the node's namespace.
            take: Gets each message and what is known about it. What it raises is counted and
                logged, and the next message is taken.
            qos: Quality of service.
        """
        self.refused = 0
        self.fault = ""
        self._node = node
        self._type = message_type
        self._take = take
        self.subscription = node.create_subscription(
            message_type, topic, self._on_message, qos, raw=True
        )

    @property
    def topic_name(self) -> str:
        """The topic's full name."""
        return str(self.subscription.topic_name)

    def take_next(self) -> bool:
        """Take one message that has come meanwhile; False if there was none."""
        with self.subscription.handle:
            taken = self.subscription.handle.take_message(self._type, True)
        if taken is None:
            return False
        self._on_message(*taken)
        return True

    def drain(self) -> None:
        """Take all messages that have come meanwhile."""
        for _ in range(_LONGEST_DRAIN):
            if not self.take_next():
                return

    def _on_message(self, data: bytes, info: Info) -> None:
        try:
            self._take(data, info)
        except Exception as error:
            reason = str(error)
            if not isinstance(error, IrlPilcoError):
                traceback.print_exc()
                reason = f"unexpected {type(error).__name__}: {error}"
            self.fault = f"{self.topic_name}: {reason}"
            self.refused += 1  # whoever sees it in another thread finds the reason there
            self._node.get_logger().warning(
                f"a message is passed over, {self.fault}", throttle_duration_sec=_WARN_EVERY
            )
