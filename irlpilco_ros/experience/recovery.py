"""`irlpilco recover`: a whole bag from one whose recorder was killed."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from mcap.records import Attachment, Channel, Header, McapRecord, Metadata, Schema
from mcap.writer import CompressionType, Writer

from irlpilco_ros.experience.bag_compression import open_unpacked
from irlpilco_ros.experience.bag_files import (
    METADATA,
    RECOVERED,
    first_free,
    make_hidden_folder,
    publish,
    suffixed,
)
from irlpilco_ros.experience.bag_metadata import FileContent, bag_information, metadata_text
from irlpilco_ros.experience.bag_reader import (
    OpenBag,
    Recording,
    messages_digest,
    open_bag,
    read_recording,
)
from irlpilco_ros.experience.bag_storage import StorageScan
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.torn_mcap import McapMessage, McapScan

_COMPRESSION = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}


@dataclass(frozen=True)
class Recovery:
    """What came of a recovery.

    Attributes:
        path: The new bag.
        messages: Number of messages in it.
        notes: What was wrong with the old one, and what could not be kept.
    """

    path: Path
    messages: int
    notes: tuple[str, ...]


def recover(path: Path) -> Recovery:
    """Write everything that is sound in a bag into a new one beside it.

    The old bag stays as it is. The new one is called NNN.recovered, or NNN.recovered.2 and so on
    if there is one already, and appears when it is complete. It holds the same records, schemas,
    attachments and metadata included; files that are whole are copied as they are.

    Args:
        path: The bag's folder or its only file.

    Raises:
        BagError: there is no bag, it is whole, or no message of it is left.
    """
    old = read_recording(path)
    if old.whole:
        raise BagError(f"{path} is whole: {old.message_count} messages; nothing to recover")
    if not old.message_count:
        raise BagError(f"{path} holds no whole message; nothing can be recovered from it")
    folder = _folder_of(path.absolute())
    try:
        hidden = make_hidden_folder(folder.parent)
        try:
            new = first_free(suffixed(folder, RECOVERED))
            _fill(hidden, new.name, open_bag(path), {**old.custom, "recovered_from": folder.name})
            _compare(path, hidden)
            publish(hidden, new)
        finally:
            shutil.rmtree(hidden, ignore_errors=True)
    except OSError as error:
        raise BagError(
            f"cannot write the recovered bag beside {folder}: {error.strerror or error}"
        ) from error
    return Recovery(new, old.message_count, _notes(old))


def _folder_of(path: Path) -> Path:
    """Return the folder that a bag has, or that a file without one could have."""
    if os.path.isdir(path):
        return path
    in_its_bag = path.name.startswith(f"{path.parent.name}_") or (path.parent / METADATA).exists()
    return path.parent if in_its_bag else path.with_name(path.name.split(".")[0] or "bag")


def _fill(hidden: Path, name: str, bag: OpenBag, custom: dict[str, str]) -> None:
    """Write the files of the new bag, called `name`, and its metadata.yaml."""
    files = []
    for number, scan in enumerate(bag.scans):
        for _ in scan.messages():
            pass
        suffix = Path(scan.path.name.removesuffix(".zstd")).suffix
        file = hidden / f"{name}_{number}{suffix}"
        if suffix == ".mcap" and (scan.tears or scan.damage):
            _rewrite(scan.path, file)
        else:
            with open_unpacked(scan.path) as source, file.open("xb") as target:
                shutil.copyfileobj(source, target)
        files.append(FileContent(file.name, scan.counts, scan.first, scan.last))
    information = bag_information(
        files,
        custom,
        _storage(bag.scans),
        "zstd" if any(scan.packed for scan in bag.scans) else "",
        bag.metadata.ros_distro or "jazzy",
    )
    (hidden / METADATA).write_text(metadata_text(information), encoding="utf-8")


def _storage(scans: Sequence[StorageScan]) -> str:
    suffixes = {Path(scan.path.name.removesuffix(".zstd")).suffix for scan in scans}
    names = {".mcap": "mcap", ".db3": "sqlite3"}
    if len(suffixes) > 1 or not suffixes <= set(names):
        raise BagError(f"files {', '.join(sorted(suffixes))} make no one bag of rosbag2")
    return names[suffixes.pop()]


def _rewrite(torn: Path, file: Path) -> None:
    """Write every sound record of a torn MCAP file into a new one."""
    with open_unpacked(torn) as source, file.open("xb") as target:
        scan = McapScan(source, str(torn))
        copy: _Copy | None = None
        for record in scan.records():
            if copy is None:
                compression = _COMPRESSION.get(scan.compression, CompressionType.NONE)
                copy = _Copy(target, compression, record)
            copy.add(record)
        if copy is not None:
            copy.writer.finish()


class _Copy:
    """A file that gets the records of another; schemas and channels may change their numbers."""

    def __init__(self, target: BinaryIO, compression: CompressionType, first: Any) -> None:
        self.writer: Any = Writer(target, compression=compression, enable_data_crcs=True)
        header = first if isinstance(first, Header) else Header("ros2", "irlpilco_ros")
        self.writer.start(header.profile, header.library)
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}

    def add(self, record: McapRecord | McapMessage) -> None:
        writer = self.writer
        if isinstance(record, McapMessage):
            if record.channel_id in self._channels:
                channel = self._channels[record.channel_id]
                data = bytes(record.data)
                writer.add_message(
                    channel, record.log_time, data, record.publish_time, record.sequence
                )
        elif isinstance(record, Schema) and record.id not in self._schemas:
            self._schemas[record.id] = writer.register_schema(
                record.name, record.encoding, record.data
            )
        elif isinstance(record, Channel) and record.id not in self._channels:
            self._channels[record.id] = writer.register_channel(
                record.topic,
                record.message_encoding,
                self._schemas.get(record.schema_id, 0),
                record.metadata,
            )
        elif isinstance(record, Attachment):
            writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )
        elif isinstance(record, Metadata) and record.name != "rosbag2":  # counts the old messages
            writer.add_metadata(record.name, record.metadata)


def _compare(path: Path, copy: Path) -> None:
    """Check that the new bag is whole and holds the sound messages of the old one."""
    if not read_recording(copy).whole or messages_digest(copy) != messages_digest(path):
        raise BagError(f"the recovered bag does not read back as {path}; is the disk sound?")


def _notes(old: Recording) -> tuple[str, ...]:
    if not old.torn and not old.damage:
        return (f"{old.metadata_problem}; all else was whole, and is copied as it was",)
    notes = [*old.torn, *(f"{each}; that part is left out" for each in old.damage)]
    if old.metadata_problem:
        notes.append(old.metadata_problem)
    if old.unverified:
        notes.append(
            f"{old.unverified} messages are from an unfinished chunk, which has no checksum yet"
        )
    return tuple(notes)
