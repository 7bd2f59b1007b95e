"""Bags of others, in every form that rosbags reads: the same trajectory comes out of all."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from foreign_bags import (
    ARM,
    SECOND,
    START,
    motion,
    on_topic,
    write_mcap,
    write_ros1,
    write_rosbag2,
    write_split,
)
from mcap.writer import CompressionType
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from irlpilco_ros.experience.bag_reader import read_bag, read_recording
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory

_HERE = Path(__file__).parent


def assert_the_motion(recorded: Trajectory, joints=ARM, steps: int = 16) -> None:
    assert recorded.joint_names == tuple(joints)
    np.testing.assert_allclose(recorded.stamps, START / SECOND + 0.5 * np.arange(steps + 1))
    told = [message.positions for message in motion(steps, joints)]
    np.testing.assert_array_equal(recorded.positions, told)
    np.testing.assert_array_equal(recorded.velocities, 0.2)


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize(
    "compression", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE]
)
def test_both_storages_with_every_compression(tmp_path, storage, compression):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion()), storage, compression)
    bag = bag.rename(tmp_path / "50% #1?")
    assert_the_motion(read_bag(bag))
    recording = read_recording(bag)
    assert recording.whole
    assert {topic.name: n for topic, n in recording.counts.items()} == {
        "/chatter": 1,
        "/joint_states": 17,
    }
    assert (recording.first, recording.last) == (START, START + 8 * SECOND)


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("chunked", [True, False])
def test_chunks_of_every_compression_and_none(tmp_path, compression, chunked):
    file = write_mcap(tmp_path / "x.mcap", motion(), compression=compression, chunked=chunked)
    assert_the_motion(read_bag(file))


def test_a_schema_in_idl_and_a_topic_in_a_namespace(tmp_path):
    assert_the_motion(read_bag(write_mcap(tmp_path / "x.mcap", motion(), idl=True)))


def test_the_files_of_a_split_bag_come_in_the_order_of_metadata_or_of_their_numbers(tmp_path):
    bag = write_split(tmp_path / "bag", motion(), 3)
    assert read_recording(bag).custom == {"place": "the workshop"}
    assert_the_motion(read_bag(bag))
    (bag / "metadata.yaml").unlink()
    assert_the_motion(read_bag(bag))  # bag_9 before bag_10


def test_a_missing_file_of_a_split_bag_is_told_and_nothing_is_learned_from_the_rest(tmp_path):
    bag = write_split(tmp_path / "bag", motion(), 3)
    (bag / "bag_10.mcap").unlink()
    with pytest.raises(BagError, match=r"lacks bag_10\.mcap, which its metadata\.yaml names"):
        read_bag(bag)
    assert not read_recording(bag).whole


def test_a_renamed_file_is_read(tmp_path):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion()))
    (bag / "bag.mcap").rename(bag / "other.mcap")
    assert_the_motion(read_bag(bag))
    assert not read_recording(bag).whole  # other tools go by metadata.yaml


@pytest.mark.parametrize("compression", [None, *Ros1Writer.CompressionFormat])
def test_a_bag_of_ros_1(tmp_path, compression):
    bag = write_ros1(tmp_path / "old.bag", motion(), compression)
    assert_the_motion(read_bag(bag))
    assert read_recording(bag).whole


def test_messages_with_half_of_the_joints_and_times_of_their_own(tmp_path):
    halves = [*motion(joints=("a", "b")), *motion(joints=("c",), late=SECOND // 1000)]
    recorded = read_bag(write_rosbag2(tmp_path / "bag", on_topic(halves)))
    assert recorded.joint_names == ("a", "b", "c")
    assert len(recorded) == 17
    np.testing.assert_allclose(np.diff(recorded.stamps), 0.5)
    np.testing.assert_allclose(recorded.positions[:, 1], 0.1 * np.arange(17) + 1)
    np.testing.assert_allclose(recorded.positions[:, 2], 0.1 * np.arange(17))


def test_halves_that_begin_with_the_second_are_not_shifted_against_each_other(tmp_path):
    halves = [*motion(joints=("a", "b"))[1:], *motion(joints=("c",), late=SECOND // 1000)]
    bag = write_rosbag2(tmp_path / "bag", on_topic(halves))
    recorded = read_bag(bag, joints=("a", "c"))
    np.testing.assert_allclose(recorded.positions[:, 0], recorded.positions[:, 1])
    assert len(recorded) == 16


def test_a_joint_that_falls_silent_makes_no_more_samples(tmp_path):
    halves = [*motion(joints=("a", "b")), *motion(joints=("c",), late=SECOND // 1000)[:5]]
    assert len(read_bag(write_rosbag2(tmp_path / "bag", on_topic(halves)))) == 5


def test_a_gripper_on_the_same_topic_is_in_nobodys_way_who_does_not_ask_for_it(tmp_path):
    entries = [*motion(), JointStateMessage(START, ("gripper",), (0.5,), (0.0,))]
    bag = write_rosbag2(tmp_path / "bag", on_topic(entries))
    assert_the_motion(read_bag(bag, joints=ARM))


def test_topics_that_complete_each_other_are_merged(tmp_path):
    left = on_topic(motion(joints=("l1", "l2")), "/left/joint_states")
    right = on_topic(motion(joints=("r1", "r2"), late=2_000_000), "/right/joint_states")
    recorded = read_bag(write_rosbag2(tmp_path / "bag", [*left, *right]))
    assert set(recorded.joint_names) == {"l1", "l2", "r1", "r2"}
    assert len(recorded) == 17


def test_of_topics_that_tell_the_same_joints_one_is_chosen(tmp_path):
    left = on_topic(motion(), "/left/joint_states")
    right = on_topic(motion(late=7), "/right/joint_states")
    bag = write_rosbag2(tmp_path / "bag", [*left, *right])
    with pytest.raises(BagError, match="/left/joint_states, /right/joint_states; choose one"):
        read_bag(bag)
    assert_the_motion(read_bag(bag, "/left/joint_states"))
    assert_the_motion(read_bag(bag, "left/joint_states"))
    with pytest.raises(BagError, match=r"there is no /middle/joint_states"):
        read_bag(bag, "/middle/joint_states")


def test_a_topic_of_another_name_is_taken_only_if_it_is_chosen(tmp_path):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion(), "/arm/measured"))
    with pytest.raises(BagError, match=r"by joint_states_topic: /arm/measured"):
        read_bag(bag)
    assert_the_motion(read_bag(bag, "/arm/measured"))


def test_commands_are_those_beside_the_chosen_states(tmp_path):
    entries = []
    for side, speed in (("left", 1.0), ("right", 2.0)):
        entries += on_topic(motion(), f"/{side}/joint_states")
        for state in motion():
            command = JointStateMessage(state.stamp, ARM, velocities=(speed,) * 3)
            entries.append((f"/{side}/joint_command", command, state.stamp))
    bag = write_rosbag2(tmp_path / "bag", entries)
    np.testing.assert_array_equal(read_bag(bag, "/right/joint_states").commands, 2.0)


def test_the_state_of_a_command_is_what_was_last_told_of_each_joint(tmp_path):
    """A policy decides when any message comes, not when a round of them is complete."""
    slow = motion(joints=("c",), late=SECOND // 10)
    fast = motion(joints=("a", "b"))
    entries = on_topic([*fast, *slow])
    command = JointStateMessage(fast[3].stamp, ("a", "b", "c"), velocities=(1.0, 2.0, 3.0))
    entries.append(("/joint_command", command, command.stamp))
    recorded = read_bag(write_rosbag2(tmp_path / "bag", entries), joints=("a", "b", "c"))
    (row,) = np.flatnonzero(recorded.commanded)
    assert not recorded.observed[row]  # what was told of c is nearly half a second old
    close = motion(joints=("c",), late=SECOND // 4)
    entries = [*on_topic([*fast, *close]), entries[-1]]
    recorded = read_bag(write_rosbag2(tmp_path / "close", entries), joints=("a", "b", "c"))
    (row,) = np.flatnonzero(recorded.commanded)
    np.testing.assert_allclose(recorded.positions[row], [0.3, 1.3, 0.2])


def test_speeds_that_are_not_told_are_nan(tmp_path):
    silent = [JointStateMessage(m.stamp, m.names, m.positions) for m in motion()]
    recorded = read_bag(write_rosbag2(tmp_path / "bag", on_topic(silent)))
    assert recorded.observed.all()
    assert np.isnan(recorded.velocities).all()


def test_a_joint_whose_name_holds_a_comma(tmp_path):
    joints = ("arm, left", "[elbow]", "wrist")
    for names in (joints, joints[1:], joints[2:]):
        given = read_bag(write_rosbag2(tmp_path / str(len(names)), on_topic(motion(joints=names))))
        bag = write_trajectory(tmp_path / "bags", given)
        assert read_bag(bag).joint_names == names


@pytest.mark.slow
def test_150_megabytes_of_images_need_100_megabytes_of_memory(tmp_path):
    """In a process of its own, by the memory that it had at most."""
    store_script = """
import sys
from pathlib import Path
import numpy as np
from mcap.writer import CompressionType, Writer
from foreign_bags import JOINT_STATE, encode, motion, schema
random = np.random.default_rng(0)
with Path(sys.argv[1]).open("wb") as stream:
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(profile="ros2")
    number = writer.register_schema(JOINT_STATE, "ros2msg", schema(JOINT_STATE)[0].encode())
    states = writer.register_channel("/joint_states", "cdr", number)
    number = writer.register_schema("sensor_msgs/msg/Image", "ros2msg", b"uint8[] data")
    images = writer.register_channel("/image", "cdr", number)
    for k, message in enumerate(motion(150)):
        writer.add_message(states, message.stamp, encode(message), message.stamp)
        writer.add_message(images, message.stamp, random.bytes(1_000_000), message.stamp)
    writer.finish()
"""
    file = tmp_path / "images.mcap"
    subprocess.run([sys.executable, "-c", store_script, str(file)], check=True, cwd=_HERE)
    assert file.stat().st_size > 150e6
    read = """
import sys
from pathlib import Path
from irlpilco_ros.experience.inspect import inspect
assert "151 over" in inspect(Path(sys.argv[1]))
(peak,) = (line for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(peak.split()[1])
"""
    run = [sys.executable, "-c", read, str(file)]
    peak = int(subprocess.run(run, check=True, capture_output=True, text=True).stdout)
    assert peak < 100 * 1024, f"{peak} KiB"
