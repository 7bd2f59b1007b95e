"""Bags that survive whatever happens to the recorder: every message is on disk when it is said.

rosbag2's MCAP conventions: profile `ros2`, `ros2msg` schemas with all their dependencies, the
offered quality of service and the type's hash with each channel, metadata.yaml version 9.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import yaml
from mcap.writer import CompressionType, Writer

from irlpilco_ros.experience.bag_files import METADATA, make_folder, make_numbered_folder
from irlpilco_ros.experience.bag_message import CUSTOM_RECORD, BagMessage, BagTopic
from irlpilco_ros.experience.durable import sync_directory, write_atomically
from irlpilco_ros.experience.errors import BagError


class DurableBagWriter:
    """Writes one bag, message by message; each is on disk when `append` returns.

    A bag that was never closed, because the process was killed, lacks metadata.yaml and MCAP's
    index; all its messages are there, and `recover` makes a whole bag of it. It is a context
    manager that closes the bag at its end.
    """

    def __init__(self, folder: Path, custom: Mapping[str, str] | None = None) -> None:
        """Make a new bag; it exists on disk when this returns.

        Args:
            folder: The bag's folder, which must not exist; its parent must.
            custom: What else readers should know, such as the recorded joints; part of the file
                from its start, and `custom_data` in metadata.yaml.

        Raises:
            BagError: the folder exists or cannot be made.
        """
        try:
            make_folder(folder)
        except OSError as error:
            raise BagError(f"cannot make the bag {folder}: {error}") from error
        self._open(folder, custom or {})

    @classmethod
    def numbered(cls, directory: Path, custom: Mapping[str, str] | None = None) -> Self:
        """Make a new bag under the next free number: directory/NNN.

        Raises:
            BagError: the directory cannot be written to.
        """
        writer = cls.__new__(cls)
        writer._open(make_numbered_folder(directory), custom or {})
        return writer

    def _open(self, folder: Path, custom: Mapping[str, str]) -> None:
        self.path = folder
        self._custom = dict(custom)
        self._channels: dict[BagTopic, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: Counter[BagTopic] = Counter()
        self._first = self._last = 0
        file = folder / f"{folder.name}_0.mcap"
        try:
            # Buffered, and flushed by hand: unbuffered files of mcap's writer end up torn.
            self._stream = file.open("xb")
            # One message is one chunk: a chunk is what a torn file loses.
            self._writer: Any = Writer(self._stream, chunk_size=1, compression=CompressionType.NONE)
            self._writer.start(profile="ros2", library="irlpilco_ros")
            self._writer.add_metadata(CUSTOM_RECORD, self._custom)
            self._sync()
            sync_directory(folder)
        except OSError as error:
            raise BagError(f"cannot make the bag {folder}: {error}") from error

    @property
    def message_count(self) -> int:
        """Number of messages on disk."""
        return self._counts.total()

    def append(self, message: BagMessage) -> None:
        """Add a message; it is on disk when this returns.

        Raises:
            BagError: it could not be written, for example because the disk is full. What was
                written before stays; the bag takes no more messages.
        """
        if self._stream.closed:
            raise BagError(f"the bag {self.path} is closed")
        topic = message.topic
        try:
            if topic not in self._channels:
                self._channels[topic] = self._register(topic)
            self._writer.add_message(
                self._channels[topic], message.log_time, message.data, message.publish_time
            )
            self._sync()
        except OSError as error:
            self._abandon()
            raise BagError(
                f"cannot write message {self.message_count + 1} to {self.path}: {error}; the "
                f"{self.message_count} before it are on disk"
            ) from error
        times = [message.log_time] if not self._counts else [self._first, message.log_time]
        self._first, self._last = min(times), max(self._last, message.log_time)
        self._counts[topic] += 1

    def close(self) -> None:
        """Write the index and metadata.yaml; a second call does nothing.

        Raises:
            BagError: they could not be written; the messages are on disk.
        """
        if self._stream.closed:
            return
        information = self._information()
        text = yaml.safe_dump(information, sort_keys=False)
        try:
            self._writer.add_metadata("rosbag2", {"serialized_metadata": text})
            self._writer.finish()
            self._sync()
            self._stream.close()
            whole = yaml.safe_dump({"rosbag2_bagfile_information": information}, sort_keys=False)
            write_atomically(self.path / METADATA, whole.encode())
        except OSError as error:
            self._abandon()
            raise BagError(
                f"cannot close the bag {self.path}: {error}; its {self.message_count} messages "
                f"are on disk: irlpilco recover {self.path}"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _sync(self) -> None:
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def _abandon(self) -> None:
        """Close the file as it is: more bytes after a failed write would make no sense."""
        # What is still in the buffer cannot be written either; the descriptor is closed.
        with suppress(OSError):
            self._stream.close()

    def _register(self, topic: BagTopic) -> int:
        if topic.message_type not in self._schemas:
            self._schemas[topic.message_type] = self._writer.register_schema(
                topic.message_type, "ros2msg", topic.definition.encode()
            )
        profiles = yaml.safe_dump([dict(profile) for profile in topic.qos_profiles])
        metadata = {"offered_qos_profiles": profiles, "topic_type_hash": topic.type_hash}
        channel: int = self._writer.register_channel(
            topic.name, "cdr", self._schemas[topic.message_type], metadata
        )
        return channel

    def _information(self) -> dict[str, Any]:
        """Return rosbag2_bagfile_information, version 9."""
        file = f"{self.path.name}_0.mcap"
        return {
            "version": 9,
            "storage_identifier": "mcap",
            **self._span(),
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.message_type,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": [dict(profile) for profile in topic.qos_profiles],
                        "type_description_hash": topic.type_hash,
                    },
                    "message_count": self._counts[topic],
                }
                for topic in self._channels
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file],
            "files": [{"path": file, **self._span()}],
            "custom_data": self._custom or None,
            "ros_distro": "jazzy",
        }

    def _span(self) -> dict[str, Any]:
        return {
            "duration": {"nanoseconds": self._last - self._first},
            "starting_time": {"nanoseconds_since_epoch": self._first},
            "message_count": self.message_count,
        }
