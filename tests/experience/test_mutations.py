"""Some hundreds of damaged bags: each is read or refused in a sentence, and nothing is touched."""

from __future__ import annotations

import random
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from damaged_bags import contents, damage
from example_trajectories import torn_bag, trial
from foreign_bags import motion, on_topic, write_mcap, write_ros1, write_rosbag2, write_split
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from irlpilco_ros.experience.bag_reader import messages_digest, read_bag
from irlpilco_ros.experience.demonstrations import checked_demonstrations, copy_demonstrations
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.inspect import inspect
from irlpilco_ros.experience.recovery import recover
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.trajectory_bag import write_trajectory

LONGEST = 20.0
"""How long any command may take on a small bag, on a busy machine [s]."""


def mcap_alone(folder: Path) -> Path:
    folder.mkdir()
    write_mcap(folder / "bag_0.mcap", motion(), attachments=[("a", b"abc")], chunk_size=2000)
    return folder


def ros1(folder: Path) -> Path:
    folder.mkdir()
    write_ros1(folder / "x.bag", motion())
    return folder


def rosbag2(storage: StoragePlugin, compression: CompressionMode) -> Callable[[Path], Path]:
    return lambda folder: write_rosbag2(folder, on_topic(motion()), storage, compression)


KINDS: dict[str, Callable[[Path], Path]] = {
    "ours": lambda folder: write_trajectory(folder, trial()),
    "ours, torn": torn_bag,
    "mcap": mcap_alone,
    "split": lambda folder: write_split(folder, motion(), 3),
    "rosbag2": rosbag2(StoragePlugin.MCAP, CompressionMode.NONE),
    "file compression": rosbag2(StoragePlugin.MCAP, CompressionMode.FILE),
    "message compression": rosbag2(StoragePlugin.MCAP, CompressionMode.MESSAGE),
    "sqlite": rosbag2(StoragePlugin.SQLITE3, CompressionMode.NONE),
    "sqlite, file compression": rosbag2(StoragePlugin.SQLITE3, CompressionMode.FILE),
    "ros 1": ros1,
}


def robot_of(joints: tuple[str, ...]) -> RobotSettings:
    """A robot that can do anything."""
    wide = (9.0,) * len(joints)
    return RobotSettings(
        joints=joints,
        position_lower=tuple(-limit for limit in wide),
        position_upper=wide,
        velocity_limit=tuple(9.0 * limit for limit in wide),
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_bag_is_read_or_refused_in_a_sentence(tmp_path, kind):
    original = KINDS[kind](tmp_path / "original")
    sound = messages_digest(original)
    robot = robot_of(read_bag(original).joint_names)
    rng = random.Random(f"11 {kind}")
    outcomes = set()
    for number in range(40):
        work = tmp_path / str(number)
        shutil.copytree(original, work / "bag")
        damage(work / "bag", rng)
        before = contents(work)
        for command in (
            lambda bag: inspect(bag, robot=robot),
            recover,
            read_bag,
            lambda bag: checked_demonstrations(bag, robot),
            messages_digest,
            lambda bag: copy_demonstrations(bag, bag.with_name("copy")),
        ):
            began = time.monotonic()
            try:
                command(work / "bag")
                outcomes.add("done")
            except BagError as error:
                outcomes.add("refused" if str(error).strip() else "refused without a word")
            assert time.monotonic() - began < LONGEST, command
        after = contents(work)
        assert {path: after[path] for path in before} == before
        assert not list(work.glob(".*")), "something half-made was left"
        shutil.rmtree(work)
    assert outcomes == {"done", "refused"}
    assert messages_digest(original) == sound


@pytest.mark.parametrize("place", range(3))
def test_no_flipped_bit_of_a_bag_of_ours_changes_what_is_read(tmp_path, place):
    """The checksums of chunks and of the whole file see to it: a sentence, or the same bits."""
    bag = write_trajectory(tmp_path / "bags", trial(steps=3))
    file = bag / "000_0.mcap"
    content = file.read_bytes()
    expected = messages_digest(bag), read_bag(bag)
    rng = random.Random(place)
    refused = 0
    for _ in range(150):
        changed = bytearray(content)
        changed[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        file.write_bytes(changed)
        try:
            recorded = read_bag(bag)
        except BagError:
            refused += 1
            continue
        assert messages_digest(bag) == expected[0]
        assert recorded.joint_names == expected[1].joint_names
        assert (recorded.positions == expected[1].positions).all()
    assert refused > 50
