"""A recording under way, without ROS: what it counts is on disk, and why it ended is told."""

from __future__ import annotations

import os
import re
import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_trajectories import assert_same
from rosbags.rosbag2 import Reader

from irlpilco_ros.experience.bag_message import BagTopic
from irlpilco_ros.experience.bag_reader import read_bag, read_path, read_recording
from irlpilco_ros.experience.joint_merging import Received
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, StreamReader, encode
from irlpilco_ros.experience.live_recording import LiveRecording
from irlpilco_ros.experience.motion import MotionSettings

JOINTS = ("elbow", "wrist")
START = 7_000_000_000
PERIOD = 100_000_000  # [ns]
STATES = BagTopic.joint_state("/joint_states")
COMMANDS = BagTopic.joint_state("/joint_command")


@pytest.fixture
def recording(tmp_path):
    return LiveRecording(tmp_path / "bags", JOINTS, PERIOD, lambda: STATES, lambda: COMMANDS)


def received(step: float, joints=JOINTS, **values) -> Received:
    stamp = START + round(step * PERIOD)
    data = encode(JointStateMessage(stamp, joints, **values))
    return Received(*StreamReader().read(data)[:4], data, received=stamp + 5, sent=stamp + 1)


def state(step: float, joints=JOINTS) -> Received:
    """The elbow moves by 1 rad/s, the wrist by 10 rad/s if it is told of alone."""
    where = {"elbow": 0.1 * step, "wrist": 0.2 + (step if len(joints) == 1 else 0.0)}
    positions = tuple(where[joint] for joint in joints)
    return received(step, joints, positions=positions, velocities=(0.3,) * len(joints))


def command(step: int, *velocities: float) -> Received:
    return received(step, velocities=velocities)


def test_there_is_a_bag_as_soon_as_every_joint_was_heard(recording, tmp_path):
    assert (recording.path, recording.samples) == (None, 0)
    assert "missing: elbow, wrist" in recording.obstacle()
    recording.take_state(state(0))
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
    assert recording.outcome() == (True, "3 samples, 0 missing, one every 0.100 s")
    np.testing.assert_array_equal(read_bag(recording.path).commands[:, 0], [0.5, -0.5, 0.0])


def test_a_command_whose_state_never_came_is_kept_and_counted_as_missing(recording):
    recording.take_state(state(0))
    recording.take_command(command(1, 0.5, 0.0))
    recording.close()
    assert recording.samples == 1
    succeeded, said = recording.outcome()
    assert not succeeded, "one state and one command of nothing"
    assert said.endswith("2 samples, 1 missing, one every 0.100 s")


def test_a_reset_of_the_clock_ends_the_recording_with_the_reason(recording):
    recording.take_state(state(30))
    recording.take_state(state(0))
    assert "jumped back from 10.000 s to 7.000 s" in recording.failure
    assert recording.settled
    recording.take_state(state(31))
    recording.close()
    assert recording.samples == len(read_bag(recording.path)) == 1
    assert recording.outcome() == (False, f"{recording.failure}; 1 samples, 0 missing")


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
    assert recording.outcome()[1].startswith(recording.failure)
    assert len(read_bag(recording.path)) == 1, "what was written before stays"


@pytest.mark.parametrize("notice", ["state", "flush", "close"])
def test_a_bag_that_was_taken_away_is_told(recording, notice):
    recording.take_state(state(0))
    recording.take_state(state(1))
    shutil.rmtree(recording.path)
    {
        "state": lambda: recording.take_state(state(2)),
        "flush": recording.flush,
        "close": recording.close,
    }[notice]()
    recording.close()
    succeeded, said = recording.outcome()
    assert not succeeded
    assert f"{recording.path}: the bag was deleted or renamed" in said
    assert "on disk" not in said


def test_another_bag_of_that_name_is_not_taken_for_this_one(recording):
    recording.take_state(state(0))
    kept = recording.path.with_name("kept")
    recording.path.rename(kept)
    shutil.copytree(kept, recording.path)
    recording.flush()
    assert "deleted or renamed" in recording.failure


def test_a_joint_that_falls_silent_is_not_recorded_as_standing_still(recording):
    for step in range(60):
        recording.take_state(state(step, JOINTS[:1]))
        if step <= 20:
            recording.take_state(state(step, JOINTS[1:]))
    assert "wrist fell silent after 2.0 s of 5.9 s" in recording.fault
    recording.close()
    succeeded, said = recording.outcome()
    assert not succeeded
    assert said.startswith("wrist fell silent after 2.0 s of 5.9 s; 21 samples, 0 missing")
    assert read_bag(recording.path).stamps[-1] == pytest.approx(9.0)


def test_a_joint_that_was_silent_for_a_while_is_told_and_its_samples_are_missing(recording):
    for step in range(60):
        recording.take_state(state(step, JOINTS[:1]))
        if not 20 < step < 40:
            recording.take_state(state(step, JOINTS[1:]))
    recording.close()
    succeeded, said = recording.outcome()
    assert succeeded
    assert "19 missing" in said
    assert said.endswith("wrist silent from 2.0 s to 4.0 s")
    assert read_bag(recording.path).missing == 19


def test_publishers_milliseconds_apart_are_merged(recording):
    """Two of them at 100 Hz, half of the joints each, the second one's stamps 5 ms behind."""
    for step in range(400):
        recording.take_state(state(0.1 * step, JOINTS[:1]))
        recording.take_state(state(0.1 * step - 0.05, JOINTS[1:]))
    recording.close()
    assert recording.outcome()[0]
    found = read_bag(recording.path)
    np.testing.assert_allclose(np.diff(found.stamps), 0.1, atol=1e-6)
    assert len(found) == 40
    assert found.stamps[0] == pytest.approx(1e-9 * START - 0.005, abs=1e-6)
    steps = (found.stamps - 1e-9 * START) / (1e-9 * PERIOD)
    np.testing.assert_allclose(found.positions[:, 1], 0.2 + steps, atol=1e-6)
    np.testing.assert_allclose(found.positions[:, 0], 0.1 * (steps + 0.05), atol=1e-6)


def test_publishers_whose_clocks_do_not_agree_make_no_samples_and_it_is_told_why(recording):
    """Stamps of the second one are 0.3 s behind; both come at 100 Hz."""
    for step in range(400):
        recording.take_state(state(0.1 * step, JOINTS[:1]))
        recording.take_state(state(0.1 * step - 3.0, JOINTS[1:]))
    assert recording.samples == 0
    assert "what is told of the joints lies 0.3" in recording.obstacle()


@pytest.mark.parametrize("velocities", [(), (0.5,), (float("nan"),) * 2])
def test_velocities_that_are_not_told_are_said_and_the_positions_are_recorded(
    recording, velocities
):
    for step in range(30):
        recording.take_state(received(step, positions=(0.1 * step, 0.2), velocities=velocities))
    assert recording.beginning() == (
        "velocities are not published; they will be computed from positions"
    )
    recording.close()
    assert recording.outcome()[0]
    found = read_bag(recording.path)
    assert len(found) == 30
    assert np.isnan(found.velocities).all()


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"positions": (0.1, float("nan"))}, "unusable: wrist: not finite"),
        ({"positions": (float("inf"),) * 2}, "unusable: elbow, wrist: not finite"),
        ({"positions": (0.1,)}, "unusable: elbow, wrist: 2 names, 1 positions"),
        ({}, "unusable: elbow, wrist: 2 names, 0 positions"),
    ],
)
def test_positions_that_cannot_be_used_make_no_sample_and_are_told(recording, values, reason):
    for step in range(5):
        recording.take_state(received(step, **values))
    assert recording.samples == 0
    assert recording.obstacle() == reason


def test_what_is_said_of_the_motion_comes_from_every_state(recording):
    """It stands for 1.9 s, moves, and stands again; the samples are 0.1 s apart, states 10 ms."""
    for step in range(1130):
        time = 0.01 * step
        way = float(np.clip(time - 1.9, 0.0, 8.1))
        recording.take_state(received(0.1 * step, positions=(0.3 * way, 0.2)))
    recording.close()
    said = recording.outcome()[1]
    found = re.search(r"([\d.]+) s of motion, from ([\d.]+) s to ([\d.]+) s of 11.3 s", said)
    assert found is not None, said
    np.testing.assert_allclose(
        [float(each) for each in found.groups()], [8.1, 1.9, 10.0], atol=0.21
    )
    assert said.endswith("first joint to move: elbow, last: elbow")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (MotionSettings(motion_distance=5.0), "nothing moved"),
        (MotionSettings(cut_to_motion=False), "; all of it counts (cut_to_motion is off)"),
    ],
)
def test_what_is_said_of_the_motion_is_what_a_learner_with_these_settings_takes(
    tmp_path, settings, said
):
    recording = LiveRecording(
        tmp_path, JOINTS, PERIOD, lambda: STATES, lambda: COMMANDS, motion=settings
    )
    for step in range(300):
        way = 0.1 * np.clip(0.01 * step - 1.0, 0.0, 1.0)
        recording.take_state(received(0.1 * step, positions=(way, 0.2)))
    recording.close()
    assert said in recording.outcome()[1]


def test_a_long_recording_costs_little_memory_and_its_end_little_time(tmp_path, monkeypatch):
    """Some minutes at 100 Hz, every state a sample; all at full rate, too."""
    monkeypatch.setattr(os, "fsync", lambda _: None)
    recording = LiveRecording(tmp_path, JOINTS, 10_000_000, lambda: STATES, lambda: COMMANDS)
    messages = [state(0.1 * step) for step in range(1000)]

    def record(begin: int, end: int) -> None:
        for step in range(begin, end):
            stamp = START + step * 10_000_000
            recording.take_state(replace(messages[step % 1000], stamp=stamp, received=stamp))

    record(0, 5_000)
    before = memory()
    record(5_000, 25_000)
    growth = (memory() - before) / 20_000
    begin = time.process_time()
    recording.close()
    assert recording.outcome()[0]
    assert time.process_time() - begin < 0.2
    assert growth < 300.0, f"{growth} bytes for each sample"


def memory() -> int:
    """Return how much memory this process has in use [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_the_full_rate_is_kept_beside_samples_that_are_as_without_it(tmp_path):
    """Every joint state and every command, in the order in which they came, and none twice."""
    bags = []
    for full_rate in (True, False):
        recording = LiveRecording(
            tmp_path / str(full_rate),
            JOINTS,
            PERIOD,
            lambda: STATES,
            lambda: COMMANDS,
            full_rate=full_rate,
        )
        for step in range(300):
            recording.take_state(state(0.1 * step))
            recording.take_state(state(0.1 * step))  # repeated, as in lockstep
            if step >= 100:
                speed = 0.0 if step >= 200 else 0.5
                recording.take_command(command(10 + (step - 100) // 10, speed, 0.0))
        recording.close()
        bags.append(recording.path)
    with_it, without = (read_recording(bag, full_rate=True) for bag in bags)
    counts = {topic.name: number for topic, number in with_it.counts.items()}
    assert counts.pop("/joint_states/full_rate") == 300
    assert counts.pop("/joint_command/full_rate") == 200
    assert counts == {topic.name: number for topic, number in without.counts.items()}
    assert_same(read_bag(bags[0]), read_bag(bags[1]))
    assert_same(read_path(bags[1]), read_bag(bags[1]))
    path = read_path(bags[0])
    np.testing.assert_allclose(path.stamps, 1e-9 * START + 0.01 * np.arange(300), atol=1e-6)
    np.testing.assert_allclose(path.positions[:, 0], 0.01 * np.arange(300), atol=1e-12)
    np.testing.assert_array_equal(path.commanded, np.isin(np.arange(300), range(100, 300, 10)))
    samples = [k for k, stamp in enumerate(path.stamps) if stamp in read_bag(bags[0]).stamps]
    np.testing.assert_array_equal(path.commands[samples], read_bag(bags[0]).commands)
    with Reader(bags[0]) as reader:
        assert {each.topic for each in reader.connections} == {
            f"/{name}{ending}"
            for name in ("joint_states", "joint_command")
            for ending in ("", "/full_rate")
        }


def test_the_full_rate_of_publishers_apart_is_merged_and_all_is_kept_after_a_flush(recording):
    for step in range(200):
        recording.take_state(state(0.1 * step, JOINTS[:1]))
        recording.take_state(state(0.1 * step - 0.05, JOINTS[1:]))
    recording.flush()
    on_disk = read_recording(recording.path, full_rate=True)
    counts = {topic.name: number for topic, number in on_disk.counts.items()}
    assert counts["/joint_states/full_rate"] == 400
    path = on_disk.path_taken()
    assert len(path) == 200
    steps = (path.stamps - 1e-9 * START) / (1e-9 * PERIOD)
    np.testing.assert_allclose(path.positions[:, 1], 0.2 + steps, atol=1e-6)
