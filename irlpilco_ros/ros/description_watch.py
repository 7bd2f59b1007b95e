"""The robot's URDF, as it was last told on robot_description."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from irlpilco_ros.ros.qos import LATCHED
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription

TOPIC = "robot_description"


class DescriptionWatch:
    """Listens to robot_description, and remembers.

    Attributes:
        text: What was last told; empty before.
    """

    def __init__(self, node: Node) -> None:
        """Listen."""
        self.text = ""
        self._heard = SafeSubscription(node, String, TOPIC, self._take, LATCHED)

    def catch_up(self) -> None:
        """Hear what has come meanwhile."""
        self._heard.drain()

    def _take(self, data: bytes, _: Info) -> None:
        self.text = str(deserialize_message(data, String).data)
