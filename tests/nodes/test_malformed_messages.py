"""Bytes that are no message end no node: each of them costs itself only, and is told."""

from __future__ import annotations

import numpy as np
import pytest
import robot_of_two
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode
from irlpilco_ros.learning.settings import values_of
from irlpilco_ros.ros.qos import JOINT_COMMAND, JOINT_STATES_PUB

pytestmark = pytest.mark.dds

HEADER = bytes((0, 1, 0, 0))  # little-endian CDR
SOUND = encode(
    JointStateMessage(1_000_000_000, robot_of_two.JOINTS, (0.0, 0.1), (0.0, 0.0), (0.0, 0.0))
)


def payloads() -> list[bytes]:
    """Truncated, bit-flipped, random and lying bytes, the same ones every time."""
    rng = np.random.default_rng(0)
    cut = [SOUND[:length] for length in range(4, len(SOUND) - 1, 9)]
    noise = [HEADER + rng.bytes(int(size)) for size in rng.integers(0, 200, 20)]
    flipped = []
    for place in rng.integers(4, len(SOUND), 20):
        changed = bytearray(SOUND)
        changed[place] ^= 0xFF
        flipped.append(bytes(changed))
    huge = HEADER + bytes(8) + (2**31 - 1).to_bytes(4, "little") * 4  # lists without end
    return [*cut, *noise, *flipped, huge]


@pytest.mark.parametrize(
    ("module", "name", "topic"),
    [
        ("irlpilco_ros.nodes.controller", "controller", "joint_states"),
        ("irlpilco_ros.nodes.demonstration_recorder", "demonstration_recorder", "joint_states"),
        ("irlpilco_ros.nodes.demonstration_recorder", "demonstration_recorder", "joint_command"),
        ("sim_bridge.demonstrator_node", "demonstrator", "joint_states"),
        ("sim_bridge.baxter_simulator_node", "baxter_simulator", "joint_command"),
        ("sim_bridge.baxter_simulator_node", "baxter_simulator", "baxter_simulator/guide"),
        ("sim_bridge.cart_pole_simulator_node", "cart_pole_simulator", "joint_command"),
    ],
)
def test_no_bytes_end_a_node(ros, tmp_path, module, name, topic):
    parameters = {}
    if "controller" in module:
        parameters = {
            name: value for name, value in values_of(robot_of_two.ROBOT).items() if value != ()
        }
    if "recorder" in module:
        parameters = {"joints": robot_of_two.JOINTS, "output_directory": str(tmp_path)}
    node = ros.start(module, parameters=parameters)
    qos = JOINT_STATES_PUB if topic == "joint_states" else JOINT_COMMAND
    publisher = ros.publisher(JointState, topic, qos, subscribers=1)
    recording = None
    if "recorder" in module:
        recording = ros.trigger_async("demonstration_recorder/start")

    def say_all_is_passed_over() -> bool:
        for payload in payloads():
            publisher.publish(payload)
        return "a message is passed over" in node.output or not node.is_alive

    ros.wait_for(say_all_is_passed_over, "a word about the messages")
    assert node.is_alive, node.output
    assert ros.get_parameter(name, "use_sim_time") is False  # it answers
    assert "is no JointState" in node.output or "are no sensor_msgs/msg/JointState" in node.output
    if recording is not None:
        ros.wait_for(recording.done, "an answer of start")
