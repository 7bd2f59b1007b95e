"""Bags read back, whole or torn: raw messages first, then the trajectory that they hold."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
import yaml
from mcap.records import Channel, McapRecord, Message, Metadata, Schema

from irlpilco_ros.experience.bag_files import METADATA, mcap_files
from irlpilco_ros.experience.bag_message import CUSTOM_RECORD, BagMessage, BagTopic
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import (
    JOINT_STATE,
    NANOSECONDS,
    JointStateMessage,
    decode,
)
from irlpilco_ros.experience.torn_mcap import read_mcap
from irlpilco_ros.experience.trajectory import Trajectory

JOINTS = "joints"
"""Key of the recorded joints in a bag's custom data, separated by commas."""

_RESET = NANOSECONDS  # stamps that jump back by more than this are another clock's [ns]


@dataclass(frozen=True)
class Recording:
    """Everything that can be read of a bag.

    Attributes:
        path: The bag.
        messages: All whole messages, in order of writing.
        custom: What the recorder knew from the start.
        torn_at: Bytes of the last file after which it is torn, or None.
        has_metadata: Whether metadata.yaml is there, which is written last.
    """

    path: Path
    messages: tuple[BagMessage, ...]
    custom: Mapping[str, str]
    torn_at: int | None
    has_metadata: bool

    @property
    def whole(self) -> bool:
        """Whether the bag was closed in good order, so that every tool reads it."""
        return self.torn_at is None and self.has_metadata

    def of_topic(self, name: str) -> list[BagMessage]:
        """Return the JointStates of the one topic whose name ends in `name`.

        Raises:
            BagError: several topics end so.
        """
        found = [
            message
            for message in self.messages
            if message.topic.message_type == JOINT_STATE
            and message.topic.name.rsplit("/", 1)[-1] == name
        ]
        topics = sorted({message.topic.name for message in found})
        if len(topics) > 1:
            raise BagError(f"{self.path} has several topics {name}: {', '.join(topics)}")
        return found


def read_recording(path: Path) -> Recording:
    """Return everything that can be read of a bag, which may be torn.

    Args:
        path: The bag's folder or its .mcap file.

    Raises:
        BagError: there is no bag, or it is none that can be read.
    """
    messages: list[BagMessage] = []
    custom: dict[str, str] = {}
    torn_at: int | None = None
    files = mcap_files(path)
    for file in files:
        content = read_mcap(file)
        messages.extend(_messages(content.records))
        for record in content.records:
            if isinstance(record, Metadata) and record.name == CUSTOM_RECORD:
                custom.update(record.metadata)
        torn_at = content.torn_at
    has_metadata = (files[0].parent / METADATA).exists()
    return Recording(path, tuple(messages), custom, torn_at, has_metadata)


def read_bag(path: Path) -> Trajectory:
    """Return the trajectory that a bag holds, whole or torn.

    A sample is a joint state of all recorded joints, with the command that bears the same header
    stamp if there is one. Messages of one sample, where a robot tells its joints in several, bear
    the same log time.

    Args:
        path: The bag's folder or its .mcap file.

    Raises:
        BagError: there is no bag, it cannot be read, or its joint states make no trajectory.
    """
    return trajectory(read_recording(path))


def trajectory(recording: Recording) -> Trajectory:
    """Return the trajectory in a recording; errors as `read_bag`."""
    commands = [decode(message.data) for message in recording.of_topic("joint_command")]
    received = [(m.log_time, decode(m.data)) for m in recording.of_topic("joint_states")]
    joints = _joints(recording, commands, [message for _, message in received])
    states = _states(recording.path, joints, received)
    decided: dict[int, np.ndarray] = {}
    for command in commands:
        decided.setdefault(command.stamp, _by_name(joints, command.names, command.command))
    stamps = sorted({*states, *decided})
    blank = np.full((2, len(joints)), np.nan)
    values = np.array([states.get(stamp, blank) for stamp in stamps]).reshape(-1, 2, len(joints))
    controls = [decided.get(stamp, blank[0]) for stamp in stamps]
    return Trajectory(
        joint_names=joints,
        stamps=np.array(stamps, dtype=np.int64) / NANOSECONDS,
        positions=values[:, 0],
        velocities=values[:, 1],
        commands=np.array(controls).reshape(-1, len(joints)),
    )


def messages_digest(path: Path) -> str:
    """Return a digest of all messages of a bag: two copies of one recording have the same.

    Raises:
        BagError: as `read_recording`.
    """
    digest = hashlib.sha256()
    for message in read_recording(path).messages:
        digest.update(f"{message.topic.name} {message.log_time} {len(message.data)}\n".encode())
        digest.update(message.data)
    return digest.hexdigest()


def _messages(records: tuple[McapRecord, ...]) -> list[BagMessage]:
    schemas: dict[int, Schema] = {}
    topics: dict[int, BagTopic] = {}
    messages = []
    for record in records:
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            topics[record.id] = _topic(record, schemas[record.schema_id])
        elif isinstance(record, Message):
            topic = topics[record.channel_id]
            messages.append(BagMessage(topic, record.data, record.log_time, record.publish_time))
    return messages


def _topic(channel: Channel, schema: Schema) -> BagTopic:
    profiles = yaml.safe_load(channel.metadata.get("offered_qos_profiles", "")) or []
    return BagTopic(
        channel.topic,
        schema.name,
        schema.data.decode(),
        channel.metadata.get("topic_type_hash", ""),
        tuple(profiles),
    )


def _joints(
    recording: Recording, commands: list[JointStateMessage], states: list[JointStateMessage]
) -> tuple[str, ...]:
    """Return the recorded joints: as the recorder says, else all that are told or commanded."""
    if recording.custom.get(JOINTS):
        return tuple(recording.custom[JOINTS].split(","))
    sources = commands or [max(states, key=lambda message: len(message.names))] if states else []
    return tuple(dict.fromkeys(name for message in sources for name in message.names))


def _states(
    path: Path, joints: tuple[str, ...], received: list[tuple[int, JointStateMessage]]
) -> dict[int, np.ndarray]:
    """Return positions and velocities (2, J) by stamp, of every sample that tells all joints."""
    states: dict[int, np.ndarray] = {}
    newest = None
    for _, group in groupby(received, key=lambda entry: entry[0]):
        parts = [message for _, message in group]
        merged = np.full((2, len(joints)), np.nan)
        for part in parts:
            told = [
                _by_name(joints, part.names, values) for values in (part.positions, part.velocities)
            ]
            merged = np.where(np.isnan(told), merged, told)
        stamp = parts[-1].stamp
        if np.isnan(merged).any() or not joints:
            continue
        if newest is not None and stamp < newest - _RESET:
            raise BagError(
                f"the stamps in {path} jump back from {newest / NANOSECONDS:.3f} s to "
                f"{stamp / NANOSECONDS:.3f} s: the robot's clock was reset while recording"
            )
        newest = stamp
        states.setdefault(stamp, merged)
    return states


def _by_name(
    joints: tuple[str, ...], names: tuple[str, ...], values: tuple[float, ...]
) -> np.ndarray:
    """Return the values of the joints, NaN where a message does not tell."""
    told = dict(zip(names, values, strict=True)) if len(names) == len(values) else {}
    return np.array([told.get(joint, np.nan) for joint in joints])
