"""A robot's URDF from the topic that robot_state_publisher tells it on."""

from __future__ import annotations

import time

from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.ros.qos import LATCHED
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.session import POLL, Session


class NoDescriptionError(IrlPilcoError):
    """Nobody tells the robot's description."""


def description_of(session: Session, topic: str, timeout: float) -> str:
    """Return what was last told on a topic of std_msgs/String; it has to be latched.

    Args:
        session: A node to listen with.
        topic: Its name.
        timeout: How long to wait for it [s].

    Raises:
        NoDescriptionError: nothing came.
    """
    heard: list[str] = []

    def take(data: bytes, _: Info) -> None:
        heard.append(str(deserialize_message(data, String).data))

    subscription = SafeSubscription(session.node, String, topic, take, LATCHED)
    name, end = subscription.topic_name, time.monotonic() + timeout
    while not heard and time.monotonic() < end:
        session.run(session.clients.sleep(POLL))
    session.node.destroy_subscription(subscription.subscription)
    if not heard:
        raise NoDescriptionError(
            f"nobody told a robot's description on {name} within {timeout:g} s; "
            "does robot_state_publisher run, in the same namespace and ROS_DOMAIN_ID, and on this "
            "computer (else: docs/security.md)?"
        )
    return heard[-1]
