"""Bags that cannot be used: each gets one sentence, soon, and little memory."""

from __future__ import annotations

import dataclasses
import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
import zstandard
from example_trajectories import trial
from foreign_bags import motion, on_topic, write_mcap, write_rosbag2
from mcap.writer import CompressionType

from irlpilco_ros.experience.bag_reader import read_bag, read_recording
from irlpilco_ros.experience.errors import BagError, UnreadableBagError
from irlpilco_ros.experience.inspect import inspect
from irlpilco_ros.experience.joint_state_cdr import StreamReader, decode, encode
from irlpilco_ros.experience.trajectory_bag import write_trajectory


def test_no_joint_state_says_what_there_is_instead(tmp_path):
    bag = write_rosbag2(tmp_path / "bag", [])
    with pytest.raises(BagError, match=r"no sensor_msgs/msg/JointState; its topics: /chatter"):
        read_bag(bag)
    assert "no trajectory" in inspect(bag)


@pytest.mark.parametrize("name", ["x.mcap", "x.db3", "x.bag", "x.mcap.zstd", "x.db3.zstd"])
@pytest.mark.parametrize("content", [b"", "grüß Gott".encode("latin-1"), bytes(99)])
def test_a_file_that_holds_something_else(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BagError, match="x"):
        read_bag(tmp_path / name)


def test_a_message_that_is_no_joint_state_is_named(tmp_path):
    states = motion()
    bag = tmp_path / "x.mcap"
    write_mcap(bag, states, compression=CompressionType.NONE)
    content = bag.read_bytes()
    data = encode(states[3])
    assert content.count(data) == 1
    bag.write_bytes(content.replace(data, data[:20] + b"\xff\xff\xff\x7f" + data[24:]))
    with pytest.raises(BagError, match=r"damaged|message 4: \d+ bytes are no sensor_msgs"):
        read_bag(bag)


def test_broken_quality_of_service_in_metadata_keeps_nobody_from_reading(tmp_path):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion()))
    document = yaml.safe_load((bag / "metadata.yaml").read_text())
    topics = document["rosbag2_bagfile_information"]["topics_with_message_count"]
    topics[0]["topic_metadata"]["offered_qos_profiles"] = "- history: {["
    (bag / "metadata.yaml").write_text(yaml.safe_dump(document))
    assert len(read_bag(bag)) == 17


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"\xff\xfe\x00", "byte 0 is not UTF-8"),
        (b"- 1\n- 2\n", "none of rosbag2's"),
        (b"a: &a [1]\nb: *a\n", "alias"),
        (b"[" * 1000, "nested"),
        (b"rosbag2_bagfile_information: {relative_file_paths: 3}", "does not list"),
    ],
)
def test_a_metadata_yaml_without_sense_is_told_and_the_bag_is_read(tmp_path, content, problem):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion()))
    (bag / "metadata.yaml").write_bytes(content)
    assert len(read_bag(bag)) == 17
    assert problem in inspect(bag)
    assert not read_recording(bag).whole


@pytest.mark.parametrize("name", ["x.mcap", "x.db3", "x.bag", "x.mcap.zstd", "x.db3.zstd"])
def test_what_is_no_file_is_not_opened(tmp_path, name):
    os.mkfifo(tmp_path / name)
    with pytest.raises(BagError, match="no regular file"):
        read_bag(tmp_path / name)
    with pytest.raises(BagError, match="no regular file"):
        read_bag(tmp_path)
    (tmp_path / name).unlink()
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(BagError, match="no regular file"):
        read_bag(tmp_path)


def test_a_metadata_yaml_that_is_no_file_is_not_opened(tmp_path):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion()))
    (bag / "metadata.yaml").unlink()
    os.mkfifo(bag / "metadata.yaml")
    assert "no regular file" in read_recording(bag).metadata_problem


def test_stamps_that_all_are_zero_make_no_motion(tmp_path):
    states = [dataclasses.replace(message, stamp=0) for message in motion()]
    entries = [("/joint_states", state, 100 + k) for k, state in enumerate(states)]
    with pytest.raises(BagError, match=r"all 17 joint states in .* bear the stamp 0\.000 s"):
        read_bag(write_rosbag2(tmp_path / "bag", entries))


BOMB = 1 << 30  # [bytes]


def bomb_chunk(folder: Path) -> Path:
    """A chunk that says that it unpacks to a little and unpacks to gigabytes."""
    packer = zstandard.ZstdCompressor(level=3).compressobj()
    zeros = bytes(1 << 24)
    data = b"".join(packer.compress(zeros) for _ in range(BOMB >> 24)) + packer.flush()
    file = folder / "x.mcap"
    write_mcap(file, [], compression=CompressionType.ZSTD)
    head = file.read_bytes()[:8]
    chunk = struct.pack("<QQQI", 1, 2, 1000, 0) + struct.pack("<I", 4) + b"zstd"
    chunk += struct.pack("<Q", len(data)) + data
    file.write_bytes(head + b"\x06" + struct.pack("<Q", len(chunk)) + chunk)
    return file


def bomb_file(folder: Path) -> Path:
    """An MCAP file that unpacks to gigabytes of one record after another."""
    record = b"\x7f" + struct.pack("<Q", 1 << 20) + bytes(1 << 20)
    packer = zstandard.ZstdCompressor(level=3).compressobj()
    whole = write_mcap(folder / "y.mcap", motion()).read_bytes()[:8]
    data = packer.compress(whole) + b"".join(packer.compress(record) for _ in range(BOMB >> 20))
    file = folder / "x.mcap.zstd"
    file.write_bytes(data + packer.flush())
    return file


def bomb_database(folder: Path) -> Path:
    packer = zstandard.ZstdCompressor(level=3).compressobj()
    zeros = bytes(1 << 24)
    data = b"".join(packer.compress(zeros) for _ in range(BOMB >> 24)) + packer.flush()
    file = folder / "x.db3.zstd"
    file.write_bytes(data)
    return file


def large_chunk(folder: Path) -> Path:
    """A chunk that says that it unpacks to more than there is."""
    file = bomb_chunk(folder)
    content = file.read_bytes()
    file.write_bytes(content.replace(struct.pack("<Q", 1000), struct.pack("<Q", BOMB * 1000), 1))
    return file


@pytest.mark.parametrize("make", [bomb_chunk, bomb_file, bomb_database, large_chunk])
def test_bombs_cost_neither_memory_nor_time(tmp_path, make):
    file = make(tmp_path)
    assert file.stat().st_size < BOMB / 1000
    script = """
import sys
from pathlib import Path
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.errors import BagError
try:
    read_bag(Path(sys.argv[1]))
except BagError as error:
    print(error, file=sys.stderr)
(peak,) = (line for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(peak.split()[1])
"""
    run = [sys.executable, "-c", script, str(file)]
    done = subprocess.run(run, check=True, capture_output=True, text=True, timeout=60)
    assert int(done.stdout) < 400 * 1024, done.stderr
    assert "x." in done.stderr


def test_a_header_is_read_only_of_what_can_be_decoded():
    """The recorder's quick reader lets nothing pass that the bag's reader would refuse."""
    reader = StreamReader()
    good = encode(motion()[0])
    assert reader.read(good)[:2] == (motion()[0].stamp, motion()[0].names)
    moved = encode(motion()[5])
    assert reader.read(moved)[:2] == (motion()[5].stamp, motion()[5].names)
    for size in range(len(good)):
        with pytest.raises(BagError):
            reader.read(good[:size])
    for place in range(len(good)):
        for bit in range(8):
            data = bytearray(good)
            data[place] ^= 1 << bit
            try:
                message = decode(bytes(data))
            except BagError:
                with pytest.raises(BagError):
                    reader.read(bytes(data))
            else:
                assert reader.read(bytes(data))[:2] == (message.stamp, message.names)
            assert reader.read(good)[:2] == (motion()[0].stamp, motion()[0].names)


def test_an_empty_folder_and_one_of_our_own_without_messages(tmp_path):
    (tmp_path / "000").mkdir()
    with pytest.raises(UnreadableBagError, match="000 is no bag"):
        read_bag(tmp_path / "000")
    bag = write_trajectory(tmp_path, trial())
    (bag / f"{bag.name}_0.mcap").write_bytes(b"")
    with pytest.raises(UnreadableBagError, match="holds no messages"):
        read_bag(bag)
    assert "torn after byte 0" in inspect(bag)
