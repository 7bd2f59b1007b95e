"""Bags as others make them: by the writers of rosbags and mcap, never by ours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from irlpilco_ros.experience.joint_state_cdr import JOINT_STATE, JointStateMessage, encode, schema

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
ARM = ("shoulder", "elbow", "wrist")
SEPARATOR = "=" * 80 + "\n"
IDL = f"""{SEPARATOR}IDL: sensor_msgs/msg/JointState
module sensor_msgs {{
  module msg {{
    struct JointState {{
      std_msgs::msg::Header header;
      sequence<string> name;
      sequence<double> position;
      sequence<double> velocity;
      sequence<double> effort;
    }};
  }};
}};
"""

QOS = {
    "history": "keep_last",
    "depth": 7,
    "reliability": "best_effort",
    "durability": "volatile",
    "deadline": {"sec": 1, "nsec": 0},
    "lifespan": {"sec": 2, "nsec": 0},
    "liveliness": "automatic",
    "liveliness_lease_duration": {"sec": 3, "nsec": 0},
    "avoid_ros_namespace_conventions": False,
}

Entry = tuple[str, JointStateMessage, int]


def motion(steps: int = 16, joints: Sequence[str] = ARM, late: int = 0) -> list[JointStateMessage]:
    """Joint states every 0.5 s, their stamps late by so many [ns]."""
    messages = []
    for k in range(steps + 1):
        positions = tuple(0.1 * k + i for i in range(len(joints)))
        speeds = tuple(0.2 for _ in joints)
        stamp = START + k * SECOND // 2 + late
        messages.append(JointStateMessage(stamp, tuple(joints), positions, speeds))
    return messages


def on_topic(messages: Iterable[JointStateMessage], topic: str = "/joint_states") -> list[Entry]:
    return [(topic, message, message.stamp) for message in messages]


def write_rosbag2(
    folder: Path,
    entries: Iterable[Entry],
    storage: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
    custom: dict[str, str] | None = None,
) -> Path:
    """A bag of rosbag2, with one more topic that is no JointState."""
    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    for key, value in (custom or {}).items():
        writer.set_custom_data(key, value)
    with writer:
        chatter = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        text = store.serialize_cdr(store.types["std_msgs/msg/String"]("hello"), chatter.msgtype)
        writer.write(chatter, START, text)
        connections: dict[str, Any] = {}
        for topic, message, time in sorted(entries, key=lambda entry: entry[2]):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, JOINT_STATE, typestore=store)
            writer.write(connections[topic], time, encode(message))
    return folder


def write_split(folder: Path, messages: Sequence[JointStateMessage], files: int) -> Path:
    """A bag of rosbag2 in several files, whose names do not sort as text does."""
    folder.mkdir()
    names = [f"{folder.name}_{9 + i}.mcap" for i in range(files)]
    for name, part in zip(names, np.array_split(np.arange(len(messages)), files), strict=True):
        write_mcap(folder / name, [messages[i] for i in part])
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        "relative_file_paths": names,
        "custom_data": {"place": "the workshop"},
    }
    (folder / "metadata.yaml").write_text(
        yaml.safe_dump({"rosbag2_bagfile_information": information})
    )
    return folder


def write_mcap(
    file: Path,
    messages: Iterable[JointStateMessage],
    idl: bool = False,
    compression: CompressionType = CompressionType.ZSTD,
    attachments: Sequence[tuple[str, bytes]] = (),
    chunk_size: int = 1 << 20,
    chunked: bool = True,
) -> Path:
    """An MCAP file of mcap's own writer."""
    with file.open("wb") as stream:
        writer: Any = McapWriter(
            stream, chunk_size=chunk_size, compression=compression, use_chunking=chunked
        )
        writer.start(profile="ros2", library="some other recorder")
        writer.add_metadata("who", {"name": "somebody"})
        for name, data in attachments:
            writer.add_attachment(1, 2, name, "text/plain", data)
        encoding, text = ("ros2idl", IDL) if idl else ("ros2msg", schema(JOINT_STATE)[0])
        number = writer.register_schema(JOINT_STATE, encoding, text.encode())
        qos = yaml.safe_dump([QOS])
        channel = writer.register_channel(
            "/arm/joint_states", "cdr", number, {"offered_qos_profiles": qos}
        )
        for k, message in enumerate(messages):
            writer.add_message(channel, message.stamp, encode(message), message.stamp - 5, k)
        writer.finish()
    return file


def write_ros1(file: Path, messages: Iterable[JointStateMessage], compression: Any = None) -> Path:
    """A bag of ROS 1."""
    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    writer = Ros1Writer(file)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connection = writer.add_connection("/joint_states", JOINT_STATE, typestore=store)
        for k, each in enumerate(messages):
            time = types["builtin_interfaces/msg/Time"](each.stamp // SECOND, each.stamp % SECOND)
            message = types[JOINT_STATE](
                types["std_msgs/msg/Header"](k, time, ""),
                list(each.names),
                np.array(each.positions),
                np.array(each.velocities),
                np.array(each.efforts),
            )
            data = store.serialize_ros1(message, JOINT_STATE)
            writer.write(connection, each.stamp, data)
    return file
