"""Bags on disk: rosbag2's conventions, read back alike by rosbags, by mcap and by us."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from example_trajectories import JOINTS, assert_same, demonstration, trial
from mcap.reader import make_reader
from mcap.records import Chunk, DataEnd
from mcap.stream_reader import StreamReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from irlpilco_ros.experience.bag_files import bag_number, bags_in, mark_discarded
from irlpilco_ros.experience.bag_message import BagMessage, BagTopic
from irlpilco_ros.experience.bag_reader import read_bag, read_messages, read_recording
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import JOINT_STATE, JointStateMessage, encode
from irlpilco_ros.experience.trajectory_bag import write_trajectory

# sensor_msgs/JointState in ROS 2 Jazzy, from share/sensor_msgs/msg/JointState.json.
JOINT_STATE_HASH = "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
QOS = {
    "history": "keep_last",
    "depth": 10,
    "reliability": "reliable",
    "durability": "volatile",
    "deadline": {"sec": 9223372036, "nsec": 854775807},
    "lifespan": {"sec": 9223372036, "nsec": 854775807},
    "liveliness": "automatic",
    "liveliness_lease_duration": {"sec": 9223372036, "nsec": 854775807},
    "avoid_ros_namespace_conventions": False,
}


def message(stamp: int = 5, topic: str = "/joint_states") -> BagMessage:
    state = JointStateMessage(stamp, JOINTS, (1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    return BagMessage(BagTopic.joint_state(topic, [QOS]), encode(state), 1000 + stamp, 900 + stamp)


@pytest.mark.parametrize("trajectory", [trial(), demonstration()], ids=["trial", "demonstration"])
def test_a_trajectory_comes_back_bit_by_bit(tmp_path, trajectory):
    bag = write_trajectory(tmp_path, trajectory)
    assert_same(read_bag(bag), trajectory)
    assert_same(read_bag(bag / "000_0.mcap"), trajectory)


def test_rosbags_mcap_and_we_read_the_same(tmp_path):
    bag = write_trajectory(tmp_path, trial())
    ours = [(m.topic.name, m.log_time, m.data) for m in read_messages(bag)]
    with Reader(bag) as reader:
        theirs = [(c.topic, t, bytes(data)) for c, t, data in reader.messages()]
    with (bag / "000_0.mcap").open("rb") as stream:
        records = list(make_reader(stream, validate_crcs=True).iter_messages())
    assert len(ours) == 34
    assert sorted(ours) == sorted(theirs)
    assert ours == [(c.topic, m.log_time, m.data) for _, c, m in records]
    store = get_typestore(Stores.ROS2_JAZZY)
    (_, _, data) = ours[0]
    decoded: Any = store.deserialize_cdr(data, JOINT_STATE)
    np.testing.assert_array_equal(decoded.position, trial().positions[0])
    assert decoded.header.stamp.sec == 1000


def test_conventions_of_rosbag2(tmp_path):
    with DurableBagWriter.numbered(tmp_path, {"joints": "a,b"}) as writer:
        writer.append(message(5))
        writer.append(message(9))
    with (tmp_path / "000" / "000_0.mcap").open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        log_times = [(m.log_time, m.publish_time) for _, _, m in reader.iter_messages()]
    assert log_times == [(1005, 905), (1009, 909)]
    (schema,) = summary.schemas.values()
    assert (schema.name, schema.encoding) == (JOINT_STATE, "ros2msg")
    for line in ("MSG: std_msgs/Header", "MSG: builtin_interfaces/Time", "float64[] effort"):
        assert line in schema.data.decode().splitlines()
    (channel,) = summary.channels.values()
    assert (channel.topic, channel.message_encoding) == ("/joint_states", "cdr")
    assert channel.metadata["topic_type_hash"] == JOINT_STATE_HASH
    assert yaml.safe_load(channel.metadata["offered_qos_profiles"]) == [QOS]
    information = yaml.safe_load((tmp_path / "000" / "metadata.yaml").read_text())
    information = information["rosbag2_bagfile_information"]
    assert yaml.safe_load(metadata["rosbag2"]["serialized_metadata"]) == information
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["relative_file_paths"] == ["000_0.mcap"]
    assert information["message_count"] == information["files"][0]["message_count"] == 2
    assert information["starting_time"]["nanoseconds_since_epoch"] == 1005
    assert information["duration"]["nanoseconds"] == 4
    assert information["custom_data"] == {"joints": "a,b"}
    (topic,) = information["topics_with_message_count"]
    assert topic["message_count"] == 2
    assert topic["topic_metadata"]["type_description_hash"] == JOINT_STATE_HASH
    assert topic["topic_metadata"]["offered_qos_profiles"] == [QOS]
    assert "&" not in (tmp_path / "000" / "metadata.yaml").read_text()  # no YAML aliases


def test_topics_that_share_a_quality_of_service_make_no_aliases(tmp_path):
    with DurableBagWriter.numbered(tmp_path) as writer:
        writer.append(message(1), message(2, "/joint_states/full_rate"))
    assert "&" not in (tmp_path / "000" / "metadata.yaml").read_text()
    assert read_recording(tmp_path / "000").whole


def test_every_message_is_on_disk_when_append_returns(tmp_path, monkeypatch):
    synced = []
    fsync = os.fsync

    def noting_fsync(descriptor: int) -> None:
        fsync(descriptor)
        synced.append(os.fstat(descriptor).st_size)

    writer = DurableBagWriter.numbered(tmp_path)
    writer.append(message(1))
    monkeypatch.setattr(os, "fsync", noting_fsync)
    file = writer.path / "000_0.mcap"
    for count in range(2, 6):
        writer.append(message(count))
        assert synced[-1] == file.stat().st_size
        assert len(synced) == count - 1
        assert len(list(read_messages(writer.path))) == count  # by another reader, at once
    writer.close()


def test_bags_are_never_overwritten(tmp_path):
    with pytest.raises(BagError, match="cannot make the bag"):
        DurableBagWriter(write_trajectory(tmp_path, trial()))
    (tmp_path / "007.discarded").mkdir()
    (tmp_path / "004_notes").mkdir()
    assert write_trajectory(tmp_path, trial()).name == "008"
    assert mark_discarded(tmp_path / "008").name == "008.discarded"
    assert write_trajectory(tmp_path, trial()).name == "009"
    assert bag_number(tmp_path / "notes") == -1


def test_recorders_in_one_folder_never_share_a_number(tmp_path):
    paths: list[Path] = []

    def write() -> None:
        for _ in range(5):
            with DurableBagWriter.numbered(tmp_path) as writer:
                writer.append(message())
                paths.append(writer.path)

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(paths)) == 20


def test_a_failing_disk_ends_the_bag_but_keeps_what_was_written(tmp_path, monkeypatch):
    writer = DurableBagWriter.numbered(tmp_path)
    writer.append(message(1))

    def broken(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", broken)
        with pytest.raises(BagError, match=r"cannot write message 2.*No space left.*1 before it"):
            writer.append(message(2))
    with pytest.raises(BagError, match="is closed"):
        writer.append(message(3))
    writer.close()
    assert not read_recording(writer.path).whole
    assert next(read_messages(writer.path)) == message(1)


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(BagError, match=r"cannot make a bag in .*file: .+"):
        DurableBagWriter.numbered(tmp_path / "file").append(message())


def test_a_bag_appears_under_its_name_with_its_first_message(tmp_path):
    writer = DurableBagWriter.numbered(tmp_path, {"joints": ",".join(JOINTS)})
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(BagError, match="no bag has been made"):
        _ = writer.path
    writer.append(message(1))
    assert [path.name for path in tmp_path.iterdir()] == ["000"]
    assert len(list(read_messages(writer.path))) == 1


SLOW_DISK = """
import os, sys, time
from pathlib import Path
import test_bag_writer
from irlpilco_ros.experience.bag_writer import DurableBagWriter
fsync, calls = os.fsync, []
def slow(descriptor):
    calls.append(descriptor)
    print("sync", flush=True)
    sys.stdin.readline()
    fsync(descriptor)
os.fsync = slow
writer = DurableBagWriter.numbered(Path(sys.argv[1]))
for count in range(1, 4):
    writer.append(test_bag_writer.message(count))
"""


@pytest.mark.parametrize("syncs", range(1, 8))
def test_whatever_bears_the_name_of_a_bag_can_be_read_whenever_its_recorder_was_killed(
    tmp_path, syncs
):
    """Killed at each of the moments at which it waits for the disk, from the first on."""
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW_DISK, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parent,
    )
    for _ in range(syncs):
        assert process.stdout.readline() == "sync\n"
        process.stdin.write("\n")
        process.stdin.flush()
    process.kill()
    process.wait()
    for bag in bags_in(tmp_path):
        assert list(read_messages(bag))
    assert bags_in(tmp_path) or syncs < 5


def test_a_full_disk_is_said_with_the_path_and_leaves_no_empty_bag(tmp_path):
    """By a limit on the size of files: the header alone is larger."""
    script = """
import resource, signal, sys
from pathlib import Path
import test_bag_writer
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import BagError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    with DurableBagWriter.numbered(Path(sys.argv[1])) as writer:
        for count in range(100):
            writer.append(test_bag_writer.message(count))
except BagError as error:
    print(error)
"""
    for limit, sentence in (
        (30, f"cannot make a bag in {tmp_path}: File too large"),
        (6000, f"to {tmp_path}/000: File too large; the "),
    ):
        run = [sys.executable, "-c", script, str(tmp_path), str(limit)]
        done = subprocess.run(
            run, check=True, capture_output=True, text=True, cwd=Path(__file__).parent
        )
        assert sentence in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["000"]
    promised = int(done.stdout.split("; the ")[1].split()[0])
    assert len(list(read_messages(tmp_path / "000"))) >= promised > 0


def test_a_bag_that_is_deleted_while_it_is_recorded_is_missed_at_once(tmp_path):
    writer = DurableBagWriter.numbered(tmp_path)
    writer.append(message(1))
    writer.path.rename(tmp_path / "elsewhere")
    with pytest.raises(BagError, match="deleted or renamed while it was recorded"):
        writer.append(message(2))


def test_the_data_have_a_checksum_of_their_own(tmp_path):
    bag = write_trajectory(tmp_path, trial())
    with (bag / "000_0.mcap").open("rb") as stream:
        records = list(StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
    (end,) = [record for record in records if isinstance(record, DataEnd)]
    assert end.data_section_crc
    assert all(record.uncompressed_crc for record in records if isinstance(record, Chunk))
