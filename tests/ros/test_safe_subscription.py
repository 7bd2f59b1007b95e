"""Whatever comes over the wire costs one message, never the process."""

from __future__ import annotations

import pytest
from malformed import malformed_payloads
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, decode, encode
from irlpilco_ros.ros.safe_subscription import SafeSubscription

JOINTS = ("elbow", "wrist")
QOS = QoSProfile(depth=1000)


@pytest.mark.dds
def test_malformed_messages_are_counted_and_the_next_good_one_is_taken(ros):
    taken = []
    subscription = SafeSubscription(
        ros.node, JointState, "joint_states", lambda data, _: taken.append(decode(data)), QOS
    )
    publisher = ros.publisher(JointState, "joint_states", QOS, subscribers=1)
    payloads = malformed_payloads(JOINTS)
    for payload in payloads:
        publisher.publish(payload)
    good = JointStateMessage(5, JOINTS, (1.0, 2.0), (3.0, 4.0))
    publisher.publish(encode(good))
    ros.wait_for(lambda: taken and taken[-1] == good, "the good message")
    assert subscription.refused + len(taken) == len(payloads) + 1
    assert subscription.refused > len(payloads) / 2
    assert "are no sensor_msgs/msg/JointState" in subscription.fault


@pytest.mark.dds
def test_an_error_of_whoever_takes_a_message_ends_nothing(ros):
    taken = []

    def take(data, _info):
        taken.append(data)
        raise ZeroDivisionError("a defect")

    subscription = SafeSubscription(ros.node, JointState, "joint_states", take, QOS)
    publisher = ros.publisher(JointState, "joint_states", QOS, subscribers=1)
    for _ in range(3):
        publisher.publish(JointState())
    ros.wait_for(lambda: len(taken) == 3, "all messages")
    ros.wait_for(lambda: subscription.refused == 3, "all errors")
    assert "unexpected ZeroDivisionError: a defect" in subscription.fault
