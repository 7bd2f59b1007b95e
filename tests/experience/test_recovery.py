from __future__ import annotations

import pytest
from example_trajectories import torn_bag, trial
from rosbags.rosbag2 import Reader

from irlpilco_ros.experience.bag_reader import read_bag, read_messages, read_recording
from irlpilco_ros.experience.errors import BagError
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
