"""`irlpilco view --live` hears where a running robot is, and says when it hears nothing."""

from __future__ import annotations

import time

import pytest
from controlled_robot import JOINTS
from fake_robot import FakeRobot
from sensor_msgs.msg import JointState

from irlpilco_ros.ros.live_robot import LiveRobot
from irlpilco_ros.ros.qos import JOINT_STATES_PUB
from irlpilco_ros.ros.session import Session


@pytest.mark.dds
def test_it_follows_joint_states_and_says_when_there_are_none(ros, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    shown = []
    with Session("irlpilco_view") as session:
        live = LiveRobot(session)

        def told(words):
            end = time.monotonic() + 30.0
            while not shown or words not in shown[-1][2]:
                assert time.monotonic() < end, shown[-1:]
                assert live.tell(lambda *what: shown.append(what))
            return shown[-1][0]

        assert told("**no joint state** on /joint_states") == {}
        with FakeRobot(ros, JOINTS, positions=[0.25, -0.5]):
            positions = told("**live**: /joint_states")
            assert {joint: positions[joint] for joint in JOINTS} == {"elbow": 0.25, "wrist": -0.5}
        assert told("**no joint state**")["elbow"] == 0.25
        assert not shown[-1][1], "no trial yet"
        topic = "controller/reference"
        reference = ros.publisher(JointState, topic, JOINT_STATES_PUB, subscribers=1)
        reference.publish(JointState(name=JOINTS, position=[0.5, 0.75]))
        end = time.monotonic() + 30.0
        while not shown[-1][1] and time.monotonic() < end:
            live.tell(lambda *what: shown.append(what))
        assert shown[-1][1] == {"elbow": 0.5, "wrist": 0.75}
