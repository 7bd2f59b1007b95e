"""Who would be moved by the controller's commands."""

from __future__ import annotations

from rclpy.node import Node

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.ros.command_topics import JOINT_COMMAND_TOPIC, moving_topics
from irlpilco_ros.ros.endpoint_names import NAMELESS, short_name

_LOOK_ON = ("controller", "demonstration_recorder", "foxglove_bridge", "rosbag2_recorder")
"""Nodes that listen to commands and move nothing, as do those of the `ros2` command."""


def receivers(node: Node, settings: ControllerSettings) -> set[str]:
    """Return the names of the nodes that a command would move, as far as is known."""
    found = {
        short_name(endpoint)
        for topic in moving_topics(settings)
        for endpoint in node.get_subscriptions_info_by_topic(node.resolve_topic_name(topic))
    }
    looking_on = {name for name in found if name.startswith("_ros2cli")}
    return found - looking_on - {node.get_name(), *_LOOK_ON}


def is_heard_by_name(node: Node, settings: ControllerSettings) -> bool:
    """Whether one of the receivers has a name: who has none may yet turn out to look on only."""
    return bool(receivers(node, settings) - {NAMELESS})


def nobody_listens(node: Node, settings: ControllerSettings) -> str:
    """Say that no command would move anything, and what to do; empty if somebody listens."""
    if receivers(node, settings):
        return ""
    topics = moving_topics(settings)
    if JOINT_COMMAND_TOPIC in topics:
        advice = (
            "start the robot's driver; or, if ros2_control moves it, start the controller with "
            "the robot's own file before the policy's: there velocity_controller_output or "
            "joint_trajectory_output says where its commands go"
        )
    else:
        advice = (
            "start the robot's driver and the controller of ros2_control that takes them, or "
            "remap the topic to that controller's name"
        )
    where = " or ".join(node.resolve_topic_name(topic) for topic in topics)
    return f"nobody listens to the commands, on {where}; {advice}"
