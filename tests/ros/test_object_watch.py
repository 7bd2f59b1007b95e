"""Where the object is: heard from every kind of publisher, and each pose counted once."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import PoseStamped

from irlpilco_ros.ros.object_watch import ObjectWatch
from irlpilco_ros.ros.qos import OBJECT_POSE_PUB, OBJECT_POSE_SUBS

pytestmark = pytest.mark.dds


def pose(x: float) -> PoseStamped:
    message = PoseStamped()
    message.pose.position.x, message.pose.orientation.w = x, 1.0
    return message


@pytest.mark.parametrize("qos", [OBJECT_POSE_PUB, OBJECT_POSE_SUBS[2]], ids=["latched", "camera"])
def test_a_pose_is_heard_whoever_tells_it_and_counted_once(ros, qos):
    taken = []
    watch = ObjectWatch(ros.node, taken.append)
    heard_by = 3 if qos is OBJECT_POSE_PUB else 1
    publisher = ros.publisher(PoseStamped, "object_pose", qos, subscribers=heard_by)
    ros.wait_for(lambda: watch.is_told, "the publisher")

    def told() -> bool:  # best effort may lose the first ones
        publisher.publish(pose(0.01 * len(taken)))
        return len(taken) >= 5

    ros.wait_for(told, "five poses")
    stamps = [each.sent for each in taken]
    assert len(set(stamps)) == len(stamps)
    assert watch.readings is not None
