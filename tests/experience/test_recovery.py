from __future__ import annotations

import subprocess
import sys

import pytest
from example_trajectories import torn_bag, trial
from foreign_bags import motion, on_topic, write_mcap, write_rosbag2, write_split
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2 import CompressionMode, Reader, StoragePlugin

from irlpilco_ros.experience.bag_reader import read_bag, read_messages, read_recording
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.experience.recovery import recover
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.joints import Joints


def test_a_torn_bag_becomes_a_whole_one_beside_it(tmp_path):
    bag = torn_bag(tmp_path)
    before = {path: path.read_bytes() for path in bag.iterdir()}
    messages = list(read_messages(bag))
    assert len(messages) == 33
    new = recover(bag).path
    assert new == tmp_path / "000.recovered"
    assert {path: path.read_bytes() for path in bag.iterdir()} == before
    recording = read_recording(new)
    assert recording.whole
    assert list(read_messages(new)) == messages
    assert recording.custom["recovered_from"] == "000"
    assert recording.custom["joints"] == "shoulder,elbow,wrist"
    with Reader(new) as reader:
        assert [bytes(data) for _, _, data in reader.messages()]
        assert reader.message_count == len(messages)


def test_a_second_recovery_overwrites_nothing(tmp_path):
    bag = torn_bag(tmp_path)
    first = recover(bag).path
    content = (first / "000.recovered_0.mcap").read_bytes()
    assert recover(bag / "000_0.mcap").path == tmp_path / "000.recovered.2"
    assert (first / "000.recovered_0.mcap").read_bytes() == content


def test_a_bag_that_only_lacks_its_metadata_is_recovered(tmp_path):
    bag = write_trajectory(tmp_path, trial())
    (bag / "metadata.yaml").unlink()
    assert read_bag(recover(bag).path).rollout(Joints(("elbow",)), 16).steps == 16


def test_a_whole_bag_and_one_without_messages_are_refused(tmp_path):
    bag = write_trajectory(tmp_path, trial())
    with pytest.raises(BagError, match="is whole: 34 messages; nothing to recover"):
        recover(bag)
    empty = torn_bag(tmp_path)
    (empty / "001_0.mcap").write_bytes((empty / "001_0.mcap").read_bytes()[:60])
    with pytest.raises(BagError, match="holds no whole message"):
        recover(empty)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["000", "001"]


def records(file):
    """Everything in an MCAP file but its index and chunks, as mcap reads it."""
    with file.open("rb") as stream:
        everything = list(StreamReader(stream).records)
    return {
        kind.__name__: [record for record in everything if isinstance(record, kind)]
        for kind in (Schema, Channel, Message, Attachment, Metadata)
    }


def test_schemas_attachments_and_metadata_records_are_kept(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    notes = [("notes.txt", b"the arm was warm"), ("more.txt", b"")]
    file = write_mcap(folder / "bag_0.mcap", motion(), idl=True, attachments=notes)
    before = records(file)
    cut_the_index_off(file)
    new = recover(folder).path
    after = records(new / "bag.recovered_0.mcap")
    for kind in ("Schema", "Channel", "Message", "Attachment"):
        assert after[kind] == before[kind], kind
    assert {each.name: each.metadata for each in after["Metadata"]} == {"who": {"name": "somebody"}}
    with Reader(new) as reader:
        (connection,) = reader.connections
        assert connection.msgdef.format.name == "IDL"
        assert isinstance(connection.ext, ConnectionExtRosbag2)
        assert connection.ext.offered_qos_profiles[0].depth == 7
        assert reader.message_count == 17


def cut_the_index_off(file):
    with file.open("rb") as stream:
        index = make_reader(stream).get_summary().chunk_indexes[-1]
    end = index.chunk_start_offset + index.chunk_length
    with file.open("rb+") as stream:
        stream.truncate(end)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_whole_messages_of_an_unfinished_last_chunk_are_kept(tmp_path, compression):
    folder = tmp_path / "bag"
    folder.mkdir()
    states = motion(3000)  # lz4 and zstd unpack block by block
    file = write_mcap(folder / "bag_0.mcap", states, compression=compression, chunk_size=1 << 22)
    with file.open("rb") as stream:
        (index,) = make_reader(stream).get_summary().chunk_indexes
    with file.open("rb+") as stream:
        stream.truncate(index.chunk_start_offset + index.chunk_length // 2)
    done = recover(folder)
    assert 300 < done.messages < 3000
    assert any(f"{done.messages} messages are from an unfinished chunk" in n for n in done.notes)
    kept = [decode(message.data) for message in read_messages(done.path)]
    assert kept == states[: done.messages]


def test_it_says_when_only_metadata_was_missing_and_copies_the_file(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    file = write_mcap(folder / "bag_0.mcap", motion())
    done = recover(folder)
    assert done.notes == ("it has no metadata.yaml; all else was whole, and is copied as it was",)
    assert (done.path / "bag.recovered_0.mcap").read_bytes() == file.read_bytes()
    assert read_recording(done.path).whole


def test_a_file_that_is_no_part_of_a_bag_becomes_one(tmp_path):
    file = write_mcap(tmp_path / "download.mcap", motion())
    assert recover(file).path == tmp_path / "download.recovered"


def test_one_torn_file_of_a_split_bag_is_mended_and_the_others_are_copied(tmp_path):
    bag = write_split(tmp_path / "bag", motion(), 3)
    cut_the_index_off(bag / "bag_10.mcap")
    assert not read_recording(bag).whole
    done = recover(bag)
    assert done.notes == (f"bag_10.mcap is torn after byte {(bag / 'bag_10.mcap').stat().st_size}",)
    for old, new in ((9, 0), (11, 2)):
        copy = done.path / f"bag.recovered_{new}.mcap"
        assert copy.read_bytes() == (bag / f"bag_{old}.mcap").read_bytes()
    with Reader(done.path) as reader:
        times = [time for _, time, _ in reader.messages()]
    assert times == [message.stamp for message in motion()]
    assert read_recording(done.path).custom["place"] == "the workshop"


def test_a_damaged_chunk_is_left_out_and_told(tmp_path):
    bag = write_trajectory(tmp_path, trial(steps=4))
    messages = list(read_messages(bag))
    file = bag / "000_0.mcap"
    content = bytearray(file.read_bytes())
    content[content.index(messages[2].data) + 30] ^= 4
    file.write_bytes(content)
    done = recover(bag)
    assert list(read_messages(done.path)) == [*messages[:2], *messages[3:]]
    assert any("that part is left out" in note for note in done.notes)


@pytest.mark.parametrize("storage", list(StoragePlugin))
@pytest.mark.parametrize(
    "compression", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE]
)
def test_a_bag_of_rosbag2_without_metadata_gets_it_back(tmp_path, storage, compression):
    bag = write_rosbag2(tmp_path / "bag", on_topic(motion()), storage, compression)
    (bag / "metadata.yaml").unlink()
    done = recover(bag)
    with Reader(done.path) as reader:
        found = [time for each, time, _ in reader.messages() if each.topic == "/joint_states"]
    assert found == [message.stamp for message in motion()]
    assert read_recording(done.path).whole


def test_a_recovery_that_fails_leaves_nothing_behind(tmp_path):
    """By a limit on the size of files, as a full disk."""
    bag = torn_bag(tmp_path)
    script = """
import resource, signal, sys
from pathlib import Path
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.recovery import recover
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))
try:
    recover(Path(sys.argv[1]))
except BagError as error:
    print(error)
"""
    run = [sys.executable, "-c", script, str(bag)]
    done = subprocess.run(run, check=True, capture_output=True, text=True)
    assert f"cannot write the recovered bag beside {bag}: File too large" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["000"]
