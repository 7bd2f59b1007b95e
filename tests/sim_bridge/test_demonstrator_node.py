"""The demonstrator guides the simulated arms, at the stamps of the joint states."""

from __future__ import annotations

import signal

import numpy as np
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_graph import RosGraph
from sensor_msgs.msg import JointState

from irlpilco_ros.ros.messages import nanoseconds
from irlpilco_ros.ros.qos import JOINT_STATES_PUB
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import load_motion

pytestmark = pytest.mark.dds

EVERY_STATE = QoSProfile(depth=5000, reliability=ReliabilityPolicy.BEST_EFFORT)
"""In lockstep states come as fast as they are answered: let a busy test lose none."""


def test_plays_the_sweep_in_lockstep(ros: RosGraph) -> None:
    ros.start("sim_bridge.baxter_simulator_node", parameters={"lockstep": True})
    demonstrator = ros.start("sim_bridge.demonstrator_node")
    refused = ros.trigger("demonstrator/play")
    assert not refused.success
    assert "call demonstrator/move_to_start first" in refused.message

    moved = ros.trigger("demonstrator/move_to_start")
    assert moved.success, moved.message

    listener = ros.listen(JointState, "joint_states", EVERY_STATE, publishers=1)
    ros.wait_for(lambda: len(listener.messages) > 1, "joint states")
    played = ros.trigger("demonstrator/play")
    assert played.success, played.message
    assert ros.node.count_publishers("joint_command") == 0, "a person does not command"

    motion = load_motion()
    begin = min(nanoseconds(m.header.stamp) for m in listener.messages if len(m.name) == 17)
    ticks = begin + 500_000_000 * np.arange(17)
    ros.wait_for(
        lambda: nanoseconds(listener.messages[-1].header.stamp) >= ticks[-1], "the last state"
    )
    states = {nanoseconds(m.header.stamp): m for m in listener.messages if len(m.name) == 17}
    stamps = sorted(states)
    by_name = [dict(zip(states[t].name, states[t].position, strict=True)) for t in stamps]
    heard = np.array([[each[name] for name in ARM_JOINTS] for each in by_name])
    # Between two states that were heard: a busy test may lose one of them.
    shown = [np.interp(ticks, stamps, course) for course in heard.T]
    wanted = [motion.at(0.5 * k)[0] for k in range(17)]
    assert np.abs(np.transpose(shown) - wanted).max() < 8e-3
    for line in ("ready to show a motion of 14 joints and 8 s", "play is done"):
        assert demonstrator.output.count(line) == 1
    assert "call demonstrator/move_to_start first" in demonstrator.output
    assert demonstrator.stop(signal.SIGTERM) == 0


def test_plays_in_real_time_from_a_file(ros: RosGraph, tmp_path) -> None:
    path = tmp_path / "wave.yaml"
    path.write_text(
        "joints: [left_w1, right_w1]\ninterval: 0.5\n"
        "positions: [[1.15, 1.0], [1.3, 0.9], [1.15, 1.0]]\n"
    )
    ros.start("sim_bridge.baxter_simulator_node")
    ros.start(
        "sim_bridge.demonstrator_node",
        parameters={"motion_file": str(path), "approach_speed": 0.03},
    )
    assert "call demonstrator/move_to_start first" in ros.trigger("demonstrator/play").message
    guided = ros.listen(JointState, "baxter_simulator/guide", publishers=1)
    moving = ros.trigger_async("demonstrator/move_to_start")
    # Asked before that, `play` might be taken first, and make this call the one that is refused.
    ros.wait_for(lambda: guided.messages or moving.done(), "the way to the start")
    assert ros.trigger("demonstrator/play").message == "busy: move_to_start is under way"
    ros.wait_for(moving.done, "the start")
    assert moving.result().success, moving.result().message
    listener = ros.listen(JointState, "joint_states", EVERY_STATE, publishers=1)
    for _ in range(5):  # in real time a busy computer guides late, and so too far
        listener.clear()
        assert ros.trigger("demonstrator/play").success
        states = [m for m in listener.messages if len(m.name) == 17]
        left = [dict(zip(m.name, m.position, strict=True))["left_w1"] for m in states]
        if (max(left), left[-1]) == pytest.approx((1.3, 1.15), abs=0.01):
            return
        assert ros.trigger("demonstrator/move_to_start").success
    pytest.fail(f"it went to {max(left)} and ended at {left[-1]} rad; expected 1.3 and 1.15")


def test_a_state_that_is_repeated_is_answered_again_but_is_no_news(ros: RosGraph) -> None:
    """As by a simulator in lockstep that did not hear the first answer."""
    ros.start("sim_bridge.demonstrator_node")
    states = ros.publisher(JointState, "joint_states", JOINT_STATES_PUB)
    guided = ros.listen(JointState, "baxter_simulator/guide", publishers=1)
    joints = list(load_motion().joints)
    state = JointState(name=joints, position=[0.0] * len(joints), velocity=[0.0] * len(joints))
    state.header.stamp.sec = 1
    moving = ros.trigger_async("demonstrator/move_to_start")

    def is_over() -> bool:
        states.publish(state)
        return bool(moving.done())

    ros.wait_for(is_over, "the answer")
    assert "no new joint_states for 5 s" in moving.result().message
    assert len(guided.messages) >= 3
    assert min(np.diff(guided.arrivals)) > 0.3


def test_without_a_simulator_it_says_so(ros: RosGraph) -> None:
    ros.start("sim_bridge.demonstrator_node")
    answer = ros.trigger("demonstrator/move_to_start")
    assert not answer.success
    assert "nobody listens to /baxter_simulator/guide" in answer.message


def test_unreadable_motion_ends_it(ros: RosGraph) -> None:
    process = ros.start(
        "sim_bridge.demonstrator_node", parameters={"motion_file": "/nowhere.yaml"}, wait=False
    )
    process.expected_code = 1
    assert process.wait() == 1
    assert "cannot read a motion: cannot read /nowhere.yaml" in process.output
