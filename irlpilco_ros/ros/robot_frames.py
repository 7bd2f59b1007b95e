"""What robot_state_publisher tells of a robot: its URDF, and where its links are.

The frames need tf2_msgs, which come with ROS 2 from apt and not with its wheels; without them the
URDF is told alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from std_msgs.msg import String

from irlpilco_ros.kinematics.rigid_motion import quaternion_of
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import LATCHED, TF

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None


@dataclass(frozen=True)
class Frame:
    """Where a frame is in its parent's.

    Attributes:
        parent: Name of the parent frame.
        name: Its own.
        pose: (4, 4) [m].
    """

    parent: str
    name: str
    pose: Array


class RobotFrames:
    """Publishes robot_description, /tf_static and /tf."""

    def __init__(self, node: Node, urdf: str, static: Sequence[Frame]) -> None:
        """Tell what does not change.

        Args:
            node: Who tells it.
            urdf: The robot's description.
            static: Frames that never move in their parents'.
        """
        self._urdf = node.create_publisher(String, "robot_description", LATCHED)
        self._urdf.publish(String(data=urdf))
        self._static: Any = None
        self._moving: Any = None
        if TFMessage is None:
            node.get_logger().info("no frames on /tf: the messages tf2_msgs are not installed")
            return
        self._static = node.create_publisher(TFMessage, "/tf_static", LATCHED)
        self._static.publish(TFMessage(transforms=transforms(0, static)))
        self._moving = node.create_publisher(TFMessage, "/tf", TF)

    @property
    def is_wanted(self) -> bool:
        """Whether anybody listens to the frames that move."""
        return self._moving is not None and self._moving.get_subscription_count() > 0

    def publish(self, stamp: int, frames: Sequence[Frame]) -> None:
        """Tell where frames are at a time [ns]; `is_wanted` says whether that is worth it."""
        self._moving.publish(TFMessage(transforms=transforms(stamp, frames)))


def transforms(stamp: int, frames: Sequence[Frame]) -> list[TransformStamped]:
    """Return frames as messages, at a time [ns]."""
    found = []
    for frame in frames:
        message = TransformStamped()
        message.header.stamp, message.header.frame_id = time_message(stamp), frame.parent
        message.child_frame_id = frame.name
        place, turn = message.transform.translation, message.transform.rotation
        place.x, place.y, place.z = map(float, frame.pose[:3, 3])
        turn.x, turn.y, turn.z, turn.w = map(float, quaternion_of(frame.pose))
        found.append(message)
    return found
