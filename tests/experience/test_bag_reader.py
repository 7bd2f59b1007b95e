"""What the reader makes of bags that are torn or foreign, and of joints told in parts."""

from __future__ import annotations

import numpy as np
import pytest
from example_trajectories import JOINTS, trial
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from irlpilco_ros.experience.bag_message import BagMessage, BagTopic
from irlpilco_ros.experience.bag_reader import (
    messages_digest,
    read_bag,
    read_messages,
    read_recording,
)
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import BagError, UnreadableBagError
from irlpilco_ros.experience.joint_state_cdr import JOINT_STATE, JointStateMessage, decode, encode
from irlpilco_ros.experience.trajectory_bag import write_trajectory

STATES = BagTopic.joint_state("/joint_states")
COMMANDS = BagTopic.joint_state("/joint_command")
SECOND = 1_000_000_000


def write(folder, *entries, joints=None):
    """Write (topic, message, log time) into a bag."""
    custom = {"joints": joints} if joints else {}
    with DurableBagWriter.numbered(folder, custom) as writer:
        for topic, content, log_time in entries:
            writer.append(BagMessage(topic, encode(content), log_time, log_time))
    return writer.path


def state(stamp, names, positions):
    velocities = tuple(10.0 * position for position in positions)
    return JointStateMessage(stamp, names, positions, velocities)


def test_a_file_cut_at_any_byte_gives_every_whole_message_before_the_cut(tmp_path):
    bag = write_trajectory(tmp_path, trial(steps=2))
    file = bag / "000_0.mcap"
    content = file.read_bytes()
    messages = list(read_messages(bag))
    # A message is there as soon as the last byte of its chunk is: the chunk ends with its data.
    ends = [content.index(message.data) + len(message.data) for message in messages]
    assert ends == sorted(ends)
    # Around every end byte by byte; between them a stride that meets all kinds of places in turn.
    cuts = {end + off for end in ends for off in (-2, -1, 0, 1)} | set(range(0, len(content), 13))
    for size in sorted(cuts, reverse=True):
        with file.open("rb+") as stream:
            stream.truncate(size)
        expected = messages[: sum(end <= size for end in ends)]
        assert list(read_messages(bag)) == expected, f"cut at byte {size}"
        recording = read_recording(bag)
        (torn,) = recording.torn
        assert int(torn.split()[-1]) <= size
        assert not recording.damage


def test_a_flipped_bit_in_a_closed_file_is_damage_and_nothing_is_learned_from_it(tmp_path):
    bag = write_trajectory(tmp_path, trial(steps=2))
    file = bag / "000_0.mcap"
    content = bytearray(file.read_bytes())
    messages = list(read_messages(bag))
    content[content.index(messages[3].data) + 30] ^= 1
    file.write_bytes(content)
    assert list(read_messages(bag)) == [*messages[:3], *messages[4:]]
    with pytest.raises(UnreadableBagError, match=r"damaged at byte \d+: the checksum of the chunk"):
        read_bag(bag)


def test_zeros_after_a_power_failure_end_the_file_there(tmp_path):
    bag = write_trajectory(tmp_path, trial(steps=2))
    file = bag / "000_0.mcap"
    messages = list(read_messages(bag))
    content = file.read_bytes()
    end = content.index(messages[2].data) + len(messages[2].data)
    file.write_bytes(content[:end] + bytes(4096))
    assert list(read_messages(bag)) == messages[:3]
    assert not read_recording(bag).whole


def test_no_bag_and_no_mcap_are_refused(tmp_path):
    with pytest.raises(UnreadableBagError, match="nothing is not there; expected a folder"):
        read_bag(tmp_path / "nothing")
    (tmp_path / "x.mcap").write_bytes(b"certainly not an MCAP file")
    with pytest.raises(BagError, match="is no MCAP file"):
        read_bag(tmp_path / "x.mcap")
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(UnreadableBagError, match="is not there"):
        read_bag(tmp_path / "file" / "000")
    with pytest.raises(BagError, match="7 bytes are no sensor_msgs"):
        decode(b"garbage")


def test_joints_told_in_several_messages_make_one_sample(tmp_path):
    bag = write(
        tmp_path,
        (STATES, state(10, ("b", "gripper"), (2.0, 9.0)), 100),
        (STATES, state(11, ("c", "a"), (3.0, 1.0)), 100),
        (STATES, state(20, ("b", "gripper"), (2.5, 9.0)), 200),
        (STATES, state(21, ("c", "a"), (3.5, 1.5)), 200),
        joints="a,b,c",
    )
    recorded = read_bag(bag)
    assert recorded.joint_names == ("a", "b", "c")
    np.testing.assert_array_equal(recorded.positions, [[1.0, 2.0, 3.0], [1.5, 2.5, 3.5]])
    np.testing.assert_array_equal(recorded.velocities, 10.0 * recorded.positions)
    np.testing.assert_array_equal(recorded.stamps, [1.1e-8, 2.1e-8])


def test_half_a_sample_at_a_tear_is_no_sample(tmp_path):
    bag = write(
        tmp_path,
        (STATES, state(10, ("a",), (1.0,)), 100),
        (STATES, state(11, ("b",), (2.0,)), 100),
        (STATES, state(20, ("a",), (1.5,)), 200),
        joints="a,b",
    )
    assert len(read_bag(bag)) == 1


def test_a_command_without_its_state_shows_as_a_missing_state(tmp_path):
    bag = write(
        tmp_path,
        (STATES, state(10, JOINTS, (1.0, 2.0, 3.0)), 100),
        (COMMANDS, JointStateMessage(20, JOINTS, velocities=(0.1, 0.2, 0.3)), 200),
    )
    recorded = read_bag(bag)
    assert recorded.observed.tolist() == [True, False]
    assert recorded.commanded.tolist() == [False, True]
    assert recorded.missing == 1


def test_effort_commands_are_commands(tmp_path):
    bag = write(
        tmp_path,
        (STATES, state(10, ("cart", "pole"), (1.0, 2.0)), 100),
        (COMMANDS, JointStateMessage(10, ("cart",), efforts=(7.0,)), 101),
        joints="cart,pole",
    )
    np.testing.assert_array_equal(read_bag(bag).commands, [[7.0, np.nan]])


def test_a_clock_that_was_reset_is_refused(tmp_path):
    entries = [(STATES, state(s * SECOND, ("a",), (1.0,)), s) for s in (5, 6, 1)]
    with pytest.raises(BagError, match=r"jump back from 6\.000 s to 1\.000 s"):
        read_bag(write(tmp_path, *entries))


def test_a_bag_of_rosbag2_itself_is_read(tmp_path):
    """Compressed chunks, every state at 100 Hz, other topics: as `ros2 bag record` makes it."""
    store = get_typestore(Stores.ROS2_JAZZY)
    forever = QosTime(9223372036, 854775807)
    qos = Qos(
        QosHistory.KEEP_LAST, 10, QosReliability.RELIABLE, QosDurability.VOLATILE,
        forever, forever, QosLiveliness.AUTOMATIC, forever, False,
    )  # fmt: skip
    text = store.types["std_msgs/msg/String"](data="hello")
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        states = writer.add_connection(
            "/joint_states", JOINT_STATE, typestore=store, offered_qos_profiles=[qos]
        )
        chatter = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for k in range(30):
            content = state(k * 10_000_000, ("a", "b"), (float(k), -float(k)))
            writer.write(states, k + 1, encode(content))
            writer.write(chatter, k + 1, store.serialize_cdr(text, "std_msgs/msg/String"))
    recorded = read_bag(tmp_path / "bag")
    assert recorded.joint_names == ("a", "b")
    np.testing.assert_array_equal(recorded.positions[:, 0], np.arange(30.0))
    recording = read_recording(tmp_path / "bag")
    assert recording.whole
    assert {topic.name: number for topic, number in recording.counts.items()} == {
        "/joint_states": 30,
        "/chatter": 30,
    }


def test_a_copy_has_the_digest_of_its_original_and_another_recording_has_not(tmp_path):
    first, second = (write_trajectory(tmp_path, trial(seed=seed)) for seed in (1, 1))
    third = write_trajectory(tmp_path, trial(seed=2))
    assert messages_digest(first) == messages_digest(second)
    assert messages_digest(first) != messages_digest(third)
