"""What RViz and Foxglove hear of a robot."""

from __future__ import annotations

import numpy as np
import pytest
from std_msgs.msg import String

from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.ros.messages import nanoseconds
from irlpilco_ros.ros.qos import LATCHED, TF
from irlpilco_ros.ros.robot_frames import Frame, transforms
from sim_bridge.robot_description import scene_urdf


def test_a_frame_is_a_transform_from_its_parent():
    place = pose((1.0, 2.0, 3.0), (0.0, 0.0, np.pi / 2.0))
    (message,) = transforms(7_000_000_001, [Frame("base", "hand", place)])
    assert (message.header.frame_id, message.child_frame_id) == ("base", "hand")
    assert nanoseconds(message.header.stamp) == 7_000_000_001
    moved, turned = message.transform.translation, message.transform.rotation
    assert (moved.x, moved.y, moved.z) == (1.0, 2.0, 3.0)
    assert (turned.z, turned.w) == pytest.approx((np.sqrt(0.5), np.sqrt(0.5)))


@pytest.mark.dds
def test_the_simulator_tells_its_description_to_whoever_comes_later(ros):
    ros.start("sim_bridge.baxter_simulator_node")
    heard = ros.listen(String, "robot_description", LATCHED)
    ros.wait_for(lambda: heard.messages, "the robot's description")
    assert heard.messages[0].data == scene_urdf()


@pytest.mark.dds
def test_the_simulator_tells_where_its_links_are(ros):
    messages = pytest.importorskip("tf2_msgs.msg", reason="ROS 2 from wheels has no tf2_msgs")
    ros.start("sim_bridge.baxter_simulator_node")
    static = ros.listen(messages.TFMessage, "/tf_static", LATCHED)
    moving = ros.listen(messages.TFMessage, "/tf", TF)
    ros.wait_for(lambda: static.messages and len(moving.messages) > 1, "frames")
    fixed = {each.child_frame_id for each in static.messages[0].transforms}
    assert {"table", "dustpan_lip", "brush_tip"} <= fixed
    told = {each.child_frame_id for each in moving.messages[-1].transforms}
    assert {"left_hand", "object"} <= told | fixed
    first, last = (nanoseconds(each.transforms[0].header.stamp) for each in
                   (moving.messages[0], moving.messages[-1]))  # fmt: skip
    assert last > first
