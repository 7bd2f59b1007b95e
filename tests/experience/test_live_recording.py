"""A recording under way, without ROS: what it counts is on disk, and why it ended is told."""

from __future__ import annotations

import os
import shutil

import numpy as np
import pytest

from irlpilco_ros.experience.bag_message import BagTopic
from irlpilco_ros.experience.bag_reader import read_bag, read_recording
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode
from irlpilco_ros.experience.live_recording import LiveRecording
from irlpilco_ros.experience.sampling import Received

JOINTS = ("elbow", "wrist")
START = 7_000_000_000
PERIOD = 100_000_000  # [ns]
STATES = BagTopic.joint_state("/joint_states")
COMMANDS = BagTopic.joint_state("/joint_command")


@pytest.fixture
def recording(tmp_path):
    return LiveRecording(tmp_path / "bags", JOINTS, PERIOD, lambda: STATES, lambda: COMMANDS)


def received(step: int, **values) -> Received:
    stamp = START + step * PERIOD
    data = encode(JointStateMessage(stamp, JOINTS, **values))
    return Received(stamp, JOINTS, data, received=stamp + 5, sent=stamp + 1)


def state(step: int) -> Received:
    return received(step, positions=(0.1 * step, 0.2), velocities=(0.3, 0.4))


def command(step: int, *velocities: float) -> Received:
    return received(step, velocities=velocities)


def test_there_is_a_bag_as_soon_as_every_joint_was_heard(recording, tmp_path):
    assert (recording.path, recording.samples) == (None, 0)
    assert recording.missing_joints == JOINTS
    recording.take_state(state(0))
    assert recording.missing_joints == ()
    assert recording.path == tmp_path / "bags" / "000"
    assert recording.samples == len(read_bag(recording.path)) == 1


def test_without_a_sample_there_is_no_bag(recording, tmp_path):
    recording.close()
    assert recording.path is None
    assert not (tmp_path / "bags").exists()


def test_a_trial_is_settled_once_its_last_command_is_zero_and_on_disk(recording):
    for step, speed in enumerate([0.5, -0.5, 0.0]):
        recording.take_command(command(step, speed, 0.0))
        assert not recording.settled, "the command waits for its state"
        recording.take_state(state(step))
        assert recording.settled == (speed == 0.0)
    recording.close()
    assert read_recording(recording.path).whole
    assert recording.summary() == "3 samples, 0 missing, one every 0.100 s"
    np.testing.assert_array_equal(read_bag(recording.path).commands[:, 0], [0.5, -0.5, 0.0])


def test_a_command_whose_state_never_came_is_kept_and_counted_as_missing(recording):
    recording.take_state(state(0))
    recording.take_command(command(1, 0.5, 0.0))
    recording.close()
    assert recording.samples == 1
    assert recording.summary() == "2 samples, 1 missing, one every 0.100 s"


def test_a_reset_of_the_clock_ends_the_recording_with_the_reason(recording):
    recording.take_state(state(30))
    recording.take_state(state(0))
    assert "jumped back from 10.000 s to 7.000 s" in recording.failure
    assert recording.settled
    recording.take_state(state(31))
    recording.close()
    assert recording.samples == len(read_bag(recording.path)) == 1
    assert recording.summary() == f"{recording.failure}; 1 samples, 0 missing"


def test_a_folder_that_cannot_be_written_to_ends_the_recording(recording, tmp_path):
    (tmp_path / "bags").write_text("no folder")
    recording.take_state(state(0))
    assert "cannot make a bag in" in recording.failure
    recording.close()
    assert (recording.path, recording.samples) == (None, 0)


def test_a_disk_that_fails_at_the_end_is_told(recording, monkeypatch):
    recording.take_state(state(0))

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        recording.close()
    assert "No space left" in recording.failure
    assert recording.summary().startswith(recording.failure)
    assert len(read_bag(recording.path)) == 1, "what was written before stays"


def test_a_bag_that_was_taken_away_is_told(recording):
    recording.take_state(state(0))
    recording.close()
    shutil.rmtree(recording.path)
    assert str(recording.path) in recording.summary()
