"""The messages of one file of a bag, whatever rosbag2 or ROS 1 made of it.

MCAP is read by our own scanner, which reads torn files; SQLite and ROS 1 by rosbags.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from mcap.records import Channel, Metadata, Schema
from rosbags.rosbag1.reader import Reader as Ros1Reader
from rosbags.rosbag1.reader import decompressors as ROS1_DECOMPRESSORS  # noqa: N812
from rosbags.rosbag2.metadata import dump_qos_v9
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from irlpilco_ros.experience.bag_compression import (
    LIMIT,
    decompress,
    message_content,
    open_unpacked,
    unpacked,
)
from irlpilco_ros.experience.bag_message import CUSTOM_RECORD, BagMessage, BagTopic
from irlpilco_ros.experience.errors import BagError, FileError, UnreadableBagError
from irlpilco_ros.experience.joint_state_cdr import JOINT_STATE
from irlpilco_ros.experience.torn_mcap import McapMessage, McapScan


class StorageScan:
    """One walk through one file of a bag.

    Attributes, complete when the walk is over:
        counts: Number of messages of each topic.
        first: Time of the first message [ns].
        last: Time of the last message [ns].
        custom: What the recorder knew from the start.
        torn_at: Number of bytes after which the file is torn, or None.
        damage: What is wrong before that; such messages are left out.
        unclosed: What else keeps other tools from reading all of it.
        unverified: Number of messages that are whole, but whose checksum is not there.
        packed: Whether rosbag2 compressed messages by themselves.
    """

    def __init__(self, path: Path) -> None:
        """Prepare to walk through a file."""
        self.path = path
        self.counts: Counter[BagTopic] = Counter()
        self.first = self.last = 0
        self.custom: dict[str, str] = {}
        self.torn_at: int | None = None
        self.damage: list[str] = []
        self.unclosed = ""
        self.unverified = 0
        self.packed = False

    @property
    def tears(self) -> list[str]:
        """Return what says that the file was not closed: nothing if it was."""
        torn = (
            [] if self.torn_at is None else [f"{self.path.name} is torn after byte {self.torn_at}"]
        )
        return [*torn, *([self.unclosed] if self.unclosed else [])]

    def messages(self, only_joint_states: bool = True) -> Iterator[BagMessage]:
        """Yield the messages, unpacked, in the order of the file.

        Args:
            only_joint_states: Whether others are counted, but not read.

        Raises:
            BagError: the file cannot be read.
        """
        try:
            if self.path.name.removesuffix(".zstd").endswith(".mcap"):
                yield from self._mcap_messages(only_joint_states)
            else:
                yield from self._rosbags_messages(only_joint_states)
        except FileError as error:
            raise BagError(str(error)) from error

    def _mcap_messages(self, only_joint_states: bool) -> Iterator[BagMessage]:
        schemas: dict[int, Schema] = {}
        topics: dict[int, BagTopic] = {}
        with open_unpacked(self.path) as stream:
            scan = McapScan(stream, str(self.path))
            for record in scan.records():
                if isinstance(record, McapMessage):
                    topic = topics.get(record.channel_id)
                    if topic is None:
                        self.damage.append(f"{self.path} is damaged: a message is of no topic")
                        continue
                    self._count(topic, record.log_time)
                    if topic.message_type == JOINT_STATE or not only_joint_states:
                        yield self._message(topic, record)
                elif isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    topics[record.id] = topic_of(record, schemas.get(record.schema_id))
                elif isinstance(record, Metadata) and record.name == CUSTOM_RECORD:
                    self.custom.update(record.metadata)
        self.torn_at, self.unclosed = scan.torn_at, scan.index_damage
        self.damage += scan.damage
        self.unverified = scan.unverified

    def _message(self, topic: BagTopic, record: McapMessage) -> BagMessage:
        data = self._unpacked(bytes(record.data))
        return BagMessage(topic, data, record.log_time, record.publish_time)

    def _unpacked(self, data: bytes) -> bytes:
        content = message_content(data, str(self.path))
        self.packed = self.packed or content is not data
        return content

    def _count(self, topic: BagTopic, log_time: int) -> None:
        if not self.counts:
            self.first = self.last = log_time
        self.first, self.last = min(self.first, log_time), max(self.last, log_time)
        self.counts[topic] += 1

    def _rosbags_messages(self, only_joint_states: bool) -> Iterator[BagMessage]:
        with unpacked(self.path) as file:
            try:
                yield from self._read_by_rosbags(file, only_joint_states)
            except (BagError, FileError):
                raise
            except (OSError, MemoryError) as error:
                raise BagError(f"cannot read {self.path}: {error}") from error
            except Exception as error:  # rosbags raises whatever its unpacking runs into
                raise UnreadableBagError(f"cannot read {self.path}: {error}") from error

    def _read_by_rosbags(self, file: Path, only_joint_states: bool) -> Iterator[BagMessage]:
        reader: Any = Ros1Reader(file) if file.suffix == ".bag" else Sqlite3Reader(_quoted(file))
        reader.open()
        try:
            if isinstance(reader, Ros1Reader):
                _bound_chunks(reader, str(self.path))
            elif (log := self.path.with_name(f"{self.path.name}-wal")).exists():
                self.unclosed = (
                    f"the newest messages may be in {log}, which is not read; bring them in by "
                    f"sqlite3 {self.path} 'PRAGMA wal_checkpoint'"
                )
            topics = {
                each.id: _topic_of(each, file.suffix == ".bag") for each in reader.connections
            }
            for each in reader.connections:
                if each.msgcount:
                    self.counts[topics[each.id]] += each.msgcount
            wanted = [
                each
                for each in reader.connections
                if each.msgcount and (each.msgtype == JOINT_STATE or not only_joint_states)
            ]
            self._take_span(reader)
            for connection, time, data in reader.messages(wanted) if wanted else ():
                content = self._unpacked(bytes(data))
                yield BagMessage(topics[connection.id], content, time, time)
        finally:
            reader.close()

    def _take_span(self, reader: Any) -> None:
        """Take over when the first and the last message came."""
        known = reader if isinstance(reader, Ros1Reader) else reader.metadata
        if self.counts:
            self.first, self.last = known.start_time, known.end_time - 1


def topic_of(channel: Channel, schema: Schema | None) -> BagTopic:
    """Return the topic of an MCAP channel; one without a schema has no type."""
    return BagTopic(
        channel.topic,
        "" if schema is None else _ros2_name(schema.name),
        "" if schema is None else schema.data.decode(errors="replace"),
        channel.metadata.get("topic_type_hash", ""),
        channel.message_encoding,
        qos_text=channel.metadata.get("offered_qos_profiles", ""),
    )


def _topic_of(connection: Any, is_ros1: bool) -> BagTopic:
    return BagTopic(
        connection.topic,
        connection.msgtype,
        connection.msgdef.data,
        "" if is_ros1 else connection.digest,
        "ros1" if is_ros1 else connection.ext.serialization_format,
        () if is_ros1 else tuple(dump_qos_v9(connection.ext.offered_qos_profiles)),
    )


def _ros2_name(name: str) -> str:
    """Return sensor_msgs/JointState, as ROS 1 has it, as sensor_msgs/msg/JointState."""
    return "/msg/".join(name.split("/")) if name.count("/") == 1 else name


def _quoted(file: Path) -> Path:
    """Return a path as rosbags puts it into the URI by which it opens SQLite."""
    return Path(quote(str(file.absolute())))


def _bound_chunks(reader: Ros1Reader, where: str) -> None:
    """Let rosbags unpack chunks with our bound; its own has none."""

    def bounded(compression: str) -> Callable[[bytes], bytes]:
        def unpack(data: bytes) -> bytes:
            content = decompress(compression, data, LIMIT, where)
            if len(content) > LIMIT:
                raise BagError(f"{where} has a chunk that unpacks to more than {LIMIT} bytes")
            return content

        return unpack

    names = {function: name for name, function in ROS1_DECOMPRESSORS.items() if name != "none"}
    for position, chunk in reader.chunks.items():
        if chunk.decompressor in names:
            unpack = bounded(names[chunk.decompressor])
            reader.chunks[position] = chunk._replace(decompressor=unpack)
