"""metadata.yaml, which rosbag2 writes last: what is in a bag, and in which of its files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

import yaml
from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

from irlpilco_ros.experience.bag_files import METADATA
from irlpilco_ros.experience.bag_message import BagTopic
from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.experience.plain_files import parse_yaml, read_yaml

_HEAD = "rosbag2_bagfile_information"
_LIMIT = 1 << 24  # [bytes]; a bag of some thousand files has a long one


@dataclass(frozen=True)
class Metadata:
    """What metadata.yaml says that the files of a bag do not.

    Attributes:
        files: Names of the bag's files, in order of recording; empty if it names none.
        custom: What else the recorder left: `custom_data`.
        ros_distro: The ROS distribution that recorded the bag.
        problem: Why it cannot be read; empty if it can.
    """

    files: tuple[str, ...] = ()
    custom: Mapping[str, str] | None = None
    ros_distro: str = ""
    problem: str = ""


@dataclass(frozen=True)
class FileContent:
    """What one file of a bag holds.

    Attributes:
        name: The file's name.
        counts: Number of messages of each topic.
        first: Time of the first message [ns].
        last: Time of the last message [ns].
    """

    name: str
    counts: Mapping[BagTopic, int]
    first: int = 0
    last: int = 0


def read_metadata(folder: Path) -> Metadata:
    """Return what a bag's metadata.yaml says, or what is wrong with it; never raises."""
    if not (folder / METADATA).exists():
        return Metadata(problem=f"it has no {METADATA}")
    try:
        document = read_yaml(folder / METADATA, _LIMIT, words_only=True)
        information = document[_HEAD]
        files = information["relative_file_paths"]
        custom = information.get("custom_data") or {}
        distro = information.get("ros_distro") or ""
    except FileError as error:
        return Metadata(problem=str(error))
    except (KeyError, TypeError, AttributeError, IndexError):
        return Metadata(problem=f"its {METADATA} is none of rosbag2's")
    if not isinstance(files, list) or not all(isinstance(name, str) for name in files):
        return Metadata(problem=f"its {METADATA} does not list the bag's files")
    words = custom.items() if isinstance(custom, dict) else ()
    return Metadata(
        files=tuple(PurePath(name).name for name in files),
        custom={k: v for k, v in words if isinstance(k, str) and isinstance(v, str)},
        ros_distro=distro if isinstance(distro, str) else "",
    )


def bag_information(
    files: Sequence[FileContent],
    custom: Mapping[str, str],
    storage: str = "mcap",
    message_compression: str = "",
    ros_distro: str = "jazzy",
) -> dict[str, Any]:
    """Return rosbag2_bagfile_information, version 9.

    Args:
        files: The bag's files, in order of recording.
        custom: Becomes `custom_data`.
        storage: mcap or sqlite3.
        message_compression: zstd if every message is compressed by itself.
        ros_distro: The ROS distribution that recorded the bag.
    """
    counts: dict[BagTopic, int] = {}
    for file in files:
        for topic, number in file.counts.items():
            counts[topic] = counts.get(topic, 0) + number
    return {
        "version": 9,
        "storage_identifier": storage,
        **_span(files),
        "topics_with_message_count": [
            {"topic_metadata": _topic(topic), "message_count": number}
            for topic, number in counts.items()
        ],
        "compression_format": message_compression,
        "compression_mode": "MESSAGE" if message_compression else "",
        "relative_file_paths": [file.name for file in files],
        "files": [{"path": file.name, **_span([file])} for file in files],
        "custom_data": dict(custom) or None,
        "ros_distro": ros_distro,
    }


def metadata_text(information: Mapping[str, Any]) -> str:
    """Return metadata.yaml with this rosbag2_bagfile_information."""
    return plain_yaml({_HEAD: dict(information)})


class _PlainDumper(yaml.SafeDumper):  # type: ignore[misc]
    """Writes out what stands in several places, where others write an alias."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def plain_yaml(value: Any) -> str:
    """Return a value as YAML without aliases, which not every reader takes."""
    text: str = yaml.dump(value, Dumper=_PlainDumper, sort_keys=False)
    return text


def _topic(topic: BagTopic) -> dict[str, Any]:
    return {
        "name": topic.name,
        "type": topic.message_type,
        "serialization_format": topic.encoding,
        "offered_qos_profiles": _profiles(topic),
        "type_description_hash": topic.type_hash,
    }


def _profiles(topic: BagTopic) -> list[Any]:
    """Return the quality of service that was offered; none where its text makes no sense."""
    if topic.qos_profiles or not topic.qos_text:
        return [dict(profile) for profile in topic.qos_profiles]
    try:
        parse_yaml(topic.qos_text, topic.name)
        return list(dump_qos_v9(parse_qos(topic.qos_text)))
    except Exception:  # rosbags raises whatever a profile lacks
        return []


def _span(files: Sequence[FileContent]) -> dict[str, Any]:
    """Return the time and the messages of these files; the order is rosbag2's."""
    filled = [file for file in files if sum(file.counts.values())]
    first = min((file.first for file in filled), default=0)
    last = max((file.last for file in filled), default=0)
    return {
        "duration": {"nanoseconds": last - first},
        "starting_time": {"nanoseconds_since_epoch": first},
        "message_count": sum(sum(file.counts.values()) for file in filled),
    }
