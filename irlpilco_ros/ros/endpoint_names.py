"""Names of the nodes behind the publishers and subscriptions of a topic."""

from __future__ import annotations

from rclpy.topic_endpoint_info import TopicEndpointInfo

NAMELESS = "somebody without a node's name"
"""No node of ROS 2; for a moment also one of which only the endpoint has been discovered yet."""

_UNKNOWN = "_NODE_NAME_UNKNOWN_"  # what the middleware says then


def full_name(endpoint: TopicEndpointInfo) -> str:
    """Return the node's name with its namespace, or NAMELESS."""
    if endpoint.node_name == _UNKNOWN:
        return NAMELESS
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def short_name(endpoint: TopicEndpointInfo) -> str:
    """Return the node's name without its namespace, or NAMELESS."""
    return NAMELESS if endpoint.node_name == _UNKNOWN else endpoint.node_name
