"""Bags that survive whatever happens to the recorder: every message is on disk when it is said.

rosbag2's MCAP conventions: profile `ros2`, `ros2msg` schemas with all their dependencies, the
offered quality of service and the type's hash with each channel, metadata.yaml version 9.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from irlpilco_ros.experience.bag_files import (
    METADATA,
    make_hidden_folder,
    next_number,
    publish,
)
from irlpilco_ros.experience.bag_message import CUSTOM_RECORD, BagMessage, BagTopic
from irlpilco_ros.experience.bag_metadata import (
    FileContent,
    bag_information,
    metadata_text,
    plain_yaml,
)
from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import BagError, FileError
from irlpilco_ros.experience.mcap_file import ChunkMessage, McapFile
from irlpilco_ros.experience.private_folder import make_private

_GONE = "what was recorded is where the bag was moved to, if it was not deleted"


class _GoneError(OSError):
    """What bears the bag's name is not what is written."""


class DurableBagWriter:
    """Writes one bag, message by message; each is on disk when `append` returns.

    The bag appears under its name with its first message, so that whatever bears the name of a
    bag can be read. One that was never closed, because the process was killed, lacks
    metadata.yaml and MCAP's index; all its messages are there, and `recover` makes a whole bag of
    it. It is a context manager that closes the bag at its end.
    """

    def __init__(self, folder: Path, custom: Mapping[str, str] | None = None) -> None:
        """Prepare a new bag.

        Args:
            folder: The bag's folder, which must not exist; its parent must.
            custom: What else readers should know, such as the recorded joints; part of the file
                from its start, and `custom_data` in metadata.yaml.

        Raises:
            BagError: the folder exists already.
        """
        if os.path.lexists(folder):
            raise BagError(f"cannot make the bag {folder}: it exists already")
        self._prepare(folder.parent, folder, custom)

    @classmethod
    def numbered(cls, directory: Path, custom: Mapping[str, str] | None = None) -> Self:
        """Prepare a new bag that gets the next free number: directory/NNN.

        Numbers are never used twice, not even those of discarded bags, and two processes never
        get the same one.
        """
        writer = cls.__new__(cls)
        writer._prepare(directory, None, custom)
        return writer

    def _prepare(self, parent: Path, folder: Path | None, custom: Mapping[str, str] | None) -> None:
        self._parent = parent
        self._folder = folder
        self._path: Path | None = None
        self._custom = dict(custom or {})
        self._channels: dict[BagTopic, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: Counter[BagTopic] = Counter()
        self._closed = False
        self._stream: BinaryIO | None = None

    @property
    def path(self) -> Path:
        """The bag.

        Raises:
            BagError: it has no name yet, because nothing has been written.
        """
        if self._path is None:
            raise BagError(f"no bag has been made in {self._parent} yet: it is made with a message")
        return self._path

    @property
    def _file(self) -> Path:
        """The bag's one file."""
        return self.path / f"{self.path.name}_0.mcap"

    @property
    def message_count(self) -> int:
        """Number of messages on disk."""
        return self._counts.total()

    def append(self, *messages: BagMessage) -> None:
        """Add messages that belong together; they are on disk when this returns.

        Raises:
            BagError: they could not be written, for example because the disk is full. What was
                written before stays; the bag takes no more messages.
        """
        if self._closed:
            raise BagError(f"the bag {self._path or self._parent} is closed")
        try:
            if self._stream is None:
                self._begin()
            self._mcap.add_messages([self._entry(message) for message in messages])
            self._sync()
            self._publish()
        except OSError as error:
            self._abandon()
            raise BagError(self._complaint(error)) from error
        self._counts.update(message.topic for message in messages)

    def look(self) -> None:
        """Look whether the bag is still there.

        Raises:
            BagError: it was deleted or renamed; it takes no more messages.
        """
        if self._closed or self._path is None:
            return
        try:
            self._check_place()
        except OSError as error:
            self._abandon()
            raise BagError(self._complaint(error)) from error

    def close(self) -> None:
        """Write the index and metadata.yaml; a second call does nothing.

        Raises:
            BagError: they could not be written; the messages are on disk.
        """
        if self._closed:
            return
        try:
            if self._stream is None:
                self._begin()
            self._publish()
            information = self._information()
            text = plain_yaml(information)
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": text})
            self._mcap.finish()
            self._sync()
            self._abandon()
            write_atomically(self.path / METADATA, metadata_text(information).encode())
        except (OSError, FileError) as error:
            self._abandon()
            kept = f"its {self.message_count} messages are on disk: irlpilco recover {self._path}"
            if isinstance(error, _GoneError):
                kept = _GONE
            raise BagError(
                f"cannot close the bag {self._path or self._parent}: {_reason(error)}; {kept}"
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

    def _begin(self) -> None:
        """Begin the file, in a hidden folder."""
        if self._folder is None:
            make_private(self._parent)
        self._hidden = make_hidden_folder(self._parent)
        # Buffered, and flushed by hand: an unbuffered file may write a part of what it is given.
        self._stream = (self._hidden / "_0.mcap").open("xb")
        self._mcap = McapFile(self._stream, profile="ros2", library="irlpilco_ros")
        self._mcap.add_metadata(CUSTOM_RECORD, self._custom)
        self._sync()

    def _publish(self) -> None:
        """Give the bag its name, if it has none yet."""
        if self._path is not None:
            return
        file = self._hidden / "_0.mcap"
        while self._path is None:
            folder = self._folder or self._parent / f"{next_number(self._parent):03d}"
            file = file.rename(self._hidden / f"{folder.name}_0.mcap")
            try:
                self._path = publish(self._hidden, folder)
            except OSError as error:
                taken = isinstance(error, FileExistsError) or error.errno == errno.ENOTEMPTY
                if not taken or self._folder is not None:
                    raise

    def _sync(self) -> None:
        assert self._stream is not None
        self._stream.flush()
        os.fsync(self._stream.fileno())
        if self._path is not None:
            self._check_place()

    def _check_place(self) -> None:
        """Check that what bears the bag's name is what is written."""
        assert self._stream is not None
        try:
            there = self._file.stat()
        except OSError:
            there = None
        own = os.fstat(self._stream.fileno())
        if there is None or not os.path.samestat(there, own):
            raise _GoneError(errno.ENOENT, "the bag was deleted or renamed while it was recorded")

    def _abandon(self) -> None:
        """Close the file as it is: more bytes after a failed write would make no sense."""
        self._closed = True
        # What is still in the buffer cannot be written either; the descriptor is closed.
        with suppress(OSError):
            if self._stream is not None:
                self._stream.close()
        if self._path is None and self._stream is not None:
            shutil.rmtree(self._hidden, ignore_errors=True)

    def _complaint(self, error: OSError) -> str:
        if self._path is None:
            return f"cannot make a bag in {self._parent}: {_reason(error)}"
        kept = f"the {self.message_count} before it are on disk"
        if isinstance(error, _GoneError):
            kept = _GONE
        return (
            f"cannot write message {self.message_count + 1} to {self._path}: {_reason(error)}; "
            f"{kept}"
        )

    def _entry(self, message: BagMessage) -> ChunkMessage:
        topic = message.topic
        if topic not in self._channels:
            self._channels[topic] = self._register(topic)
        return ChunkMessage(
            self._channels[topic], message.log_time, message.publish_time, message.data
        )

    def _register(self, topic: BagTopic) -> int:
        if topic.message_type not in self._schemas:
            self._schemas[topic.message_type] = self._mcap.add_schema(
                topic.message_type, topic.definition.encode()
            )
        profiles = plain_yaml([dict(profile) for profile in topic.qos_profiles])
        metadata = {"offered_qos_profiles": profiles, "topic_type_hash": topic.type_hash}
        return self._mcap.add_channel(topic.name, self._schemas[topic.message_type], metadata)

    def _information(self) -> dict[str, Any]:
        counts = {topic: self._counts[topic] for topic in self._channels}
        file = FileContent(self._file.name, counts, self._mcap.first, self._mcap.last)
        return bag_information([file], self._custom)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
