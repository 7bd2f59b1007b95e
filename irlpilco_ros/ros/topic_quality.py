"""What a bag should know about a topic: its name and what its publishers offer."""

from __future__ import annotations

from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile

from irlpilco_ros.experience.bag_message import BagTopic
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS, schema
from irlpilco_ros.experience.object_pose import POSE_STAMPED


def joint_state_topic(node: Node, name: str) -> BagTopic:
    """Return a topic of JointStates with the quality of service of its present publishers."""
    publishers = node.get_publishers_info_by_topic(name)
    return BagTopic.joint_state(name, [qos_entry(each.qos_profile) for each in publishers])


def object_pose_topic(node: Node, name: str) -> BagTopic:
    """Return a topic of PoseStamped with the quality of service of its present publishers."""
    definition, type_hash = schema(POSE_STAMPED)
    profiles = [qos_entry(each.qos_profile) for each in node.get_publishers_info_by_topic(name)]
    return BagTopic(name, POSE_STAMPED, definition, type_hash, qos_profiles=tuple(profiles))


def qos_entry(profile: QoSProfile) -> dict[str, Any]:
    """Return a quality of service as rosbag2 writes it (metadata version 9)."""
    return {
        "history": profile.history.name.lower(),
        "depth": profile.depth,
        "reliability": profile.reliability.name.lower(),
        "durability": profile.durability.name.lower(),
        "deadline": _duration(profile.deadline),
        "lifespan": _duration(profile.lifespan),
        "liveliness": profile.liveliness.name.lower(),
        "liveliness_lease_duration": _duration(profile.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": profile.avoid_ros_namespace_conventions,
    }


def _duration(duration: Duration) -> dict[str, int]:
    seconds, rest = divmod(duration.nanoseconds, NANOSECONDS)
    return {"sec": seconds, "nsec": rest}
