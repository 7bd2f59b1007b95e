"""MCAP files from their start to their end, or up to the point where they are torn.

The readers of mcap and rosbags want an index, take a cut-off last record for a whole one, and
unpack whatever they are given. Here a record counts only if all its bytes are there and its
checksum is right, one chunk at a time is in memory, and no chunk may be larger than a limit.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any, BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Header,
    McapRecord,
    Metadata,
    Schema,
)
from mcap.writer import MCAP0_MAGIC

from irlpilco_ros.experience.bag_compression import LIMIT, decompress
from irlpilco_ros.experience.errors import BagError, UnreadableBagError

_FRAME = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK = struct.Struct("<QQQII")
_LENGTH = struct.Struct("<Q")
_ENDING = _FRAME.size + 20 + len(MCAP0_MAGIC)  # a footer record, then the magic bytes again
_FOOTER_COVERED = _FRAME.size + 16  # so much of a footer is covered by its own checksum
_PIECE = 1 << 20
_BROKEN = (McapError, struct.error, ValueError, OverflowError)
_READERS: dict[int, Callable[[ReadDataStream], Any]] = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
    Opcode.ATTACHMENT: Attachment.read,
}


class McapMessage(NamedTuple):
    """A message in an MCAP file; its data are there until the next record is asked for."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: memoryview


class McapScan:
    """One walk through an MCAP file.

    Attributes, complete when the walk is over:
        torn_at: Number of bytes after which nothing whole comes, or None if the file is closed.
        damage: What is wrong before that: records whose checksums are wrong or that make no sense.
        index_damage: What is wrong with the index, which other tools need; empty if nothing is.
        unverified: Number of messages in an unfinished last chunk, whose checksum is not there.
        compression: Compression of the first chunk: zstd, lz4, or nothing.
    """

    def __init__(self, stream: BinaryIO, name: str) -> None:
        """Prepare to walk through a stream; `name` is for messages."""
        self.torn_at: int | None = None
        self.damage: list[str] = []
        self.index_damage = ""
        self.unverified = 0
        self.compression = ""
        self._stream = stream
        self._name = name
        self._crc = zlib.crc32(MCAP0_MAGIC)
        self._suspect: tuple[int, str] | None = None
        self._messages = 0

    def records(self) -> Iterator[McapRecord | McapMessage]:
        """Yield header, schemas, channels, messages, metadata and attachments as written.

        Raises:
            BagError: this is no MCAP file, it cannot be read, or it is compressed in a way that is
                not known or to more than the limit.
        """
        magic = self._read(len(MCAP0_MAGIC))
        if not MCAP0_MAGIC.startswith(magic):
            raise UnreadableBagError(f"{self._name} is no MCAP file: it does not start as one")
        start = len(magic)
        rest = b""
        while start >= len(MCAP0_MAGIC):
            head = self._read(_FRAME.size)
            # A power failure can leave zeros where a record should be: 0 is no opcode.
            if len(head) < _FRAME.size or head[0] == 0:
                break
            opcode, length = _FRAME.unpack(head)
            payload = self._payload(start, length)
            if len(payload) < length:
                rest = payload
                if opcode == Opcode.CHUNK:
                    yield from self._unfinished_chunk(payload)
                break
            self._confirm_suspect()
            if opcode == Opcode.DATA_END:
                self._finish(start, payload)
                return
            self._crc = zlib.crc32(payload, zlib.crc32(head, self._crc))
            yield from self._parse(opcode, payload, start)
            start += _FRAME.size + length
        self._break_off(start, rest)

    def _read(self, size: int) -> bytes:
        try:
            return self._stream.read(size)
        except OSError as error:
            raise BagError(f"cannot read {self._name}: {error.strerror or error}") from error

    def _payload(self, start: int, length: int) -> bytes:
        """Return the bytes of a record, or those that are there."""
        if length <= LIMIT:
            return self._read(length)
        rest = self._read(LIMIT + 1)
        if len(rest) > LIMIT:
            raise BagError(
                f"{self._name} has a record of {length} bytes at byte {start}; records of up to "
                f"{LIMIT} bytes are read"
            )
        return rest

    def _confirm_suspect(self) -> None:
        """Call what made no sense damage: as something comes after it, it is no torn end."""
        if self._suspect is not None:
            self._call_damaged(*self._suspect)
            self._suspect = None

    def _call_damaged(self, start: int, reason: str) -> None:
        self.damage.append(f"{self._name} is damaged at byte {start}: {reason}")

    def _break_off(self, start: int, rest: bytes) -> None:
        """End the walk where no whole record comes: at a tear, or at damage in a closed file."""
        while piece := self._read(_PIECE):
            rest = rest[-len(MCAP0_MAGIC) :] + piece
        if rest.endswith(MCAP0_MAGIC):
            self._call_damaged(start, "what follows is no record")
        self.torn_at = start if self._suspect is None else self._suspect[0]

    def _parse(self, opcode: int, payload: bytes, start: int) -> list[McapRecord | McapMessage]:
        """Return what a record holds; that it makes no sense is remembered."""
        try:
            if opcode == Opcode.CHUNK:
                records = self._chunk(payload)
            elif opcode == Opcode.MESSAGE:
                records = [_message(memoryview(payload))]
            else:
                records = _record(opcode, payload)
        except _BROKEN as error:
            self._suspect = (start, str(error) or type(error).__name__)
            return []
        self._messages += sum(isinstance(record, McapMessage) for record in records)
        return records

    def _chunk(self, payload: bytes) -> list[McapRecord | McapMessage]:
        chunk = _Chunk.split(payload)
        if len(chunk.data) != chunk.length:
            raise ValueError("the chunk is shorter than it says")
        self.compression = self.compression or chunk.compression
        content = decompress(chunk.compression, chunk.data, chunk.size, self._name)
        if len(content) != chunk.size:
            raise ValueError(f"the chunk unpacks to other than {chunk.size} bytes, as it says")
        if chunk.crc and zlib.crc32(content) != chunk.crc:
            raise ValueError("the checksum of the chunk is wrong")
        return list(_inner_records(content, whole=True))

    def _unfinished_chunk(self, payload: bytes) -> Iterator[McapRecord | McapMessage]:
        """Yield what is whole of a chunk whose end is not there."""
        try:
            chunk = _Chunk.split(payload)
            content = decompress(chunk.compression, chunk.data, chunk.size, self._name)
            for record in _inner_records(content, whole=False):
                self.unverified += isinstance(record, McapMessage)
                yield record
        except (*_BROKEN, BagError):
            return

    def _finish(self, start: int, payload: bytes) -> None:
        """Check the checksum of all data, then the index and the end of the file."""
        crc = int.from_bytes(payload[:4], "little")
        if crc and crc != self._crc and not self.damage:
            self.damage.append(f"{self._name} is damaged: the checksum of its data is wrong")
        index = self._read(LIMIT)
        ending = index[-_ENDING:]
        if (
            len(ending) < _ENDING
            or _FRAME.unpack_from(ending) != (Opcode.FOOTER, 20)
            or not ending.endswith(MCAP0_MAGIC)
        ):
            self.torn_at = start
            return
        index, covered = index[:-_ENDING], index[: _FOOTER_COVERED - _ENDING]
        (crc,) = struct.unpack_from("<I", ending, _FOOTER_COVERED)
        if crc and zlib.crc32(covered) != crc:
            self.index_damage = f"the index of {self._name} is damaged: its checksum is wrong"
            return
        counted = _counted(index)
        if counted is not None and counted != self._messages and not self.damage:
            self.damage.append(
                f"{self._name} is damaged: it holds {self._messages} messages where its index "
                f"counts {counted}"
            )


class _Chunk(NamedTuple):
    """The fields of a chunk record; `data` may be shorter than `length` in a torn file."""

    size: int
    crc: int
    compression: str
    length: int
    data: memoryview

    @classmethod
    def split(cls, payload: bytes) -> _Chunk:
        _, _, size, crc, letters = _CHUNK.unpack_from(payload)
        start = _CHUNK.size + letters
        compression = payload[_CHUNK.size : start].decode()
        (length,) = _LENGTH.unpack_from(payload, start)
        start += _LENGTH.size
        return cls(size, crc, compression, length, memoryview(payload)[start : start + length])


def _inner_records(content: bytes, whole: bool) -> Iterator[McapRecord | McapMessage]:
    """Yield the records of a chunk's content.

    Raises:
        ValueError: a record is cut off, and the chunk is meant to be whole.
    """
    view, start = memoryview(content), 0
    while start < len(view):
        if start + _FRAME.size > len(view):
            break
        opcode, length = _FRAME.unpack_from(view, start)
        end = start + _FRAME.size + length
        if end > len(view) or opcode == 0:
            break
        payload = view[start + _FRAME.size : end]
        if opcode == Opcode.MESSAGE:
            yield _message(payload)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            yield from _record(opcode, bytes(payload))
        start = end
    if whole and start != len(view):
        raise ValueError("a record in the chunk is cut off")


def _message(payload: memoryview) -> McapMessage:
    channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(payload)
    return McapMessage(channel, sequence, log_time, publish_time, payload[_MESSAGE.size :])


def _record(opcode: int, payload: bytes) -> list[McapRecord | McapMessage]:
    """Return a record of a kind that matters, nothing for another."""
    read = _READERS.get(opcode)
    return [read(ReadDataStream(BytesIO(payload)))] if read is not None else []


def _counted(index: bytes) -> int | None:
    """Return how many messages the index counts, None where it does not."""
    start = 0
    while start + _FRAME.size <= len(index):
        opcode, length = _FRAME.unpack_from(index, start)
        start += _FRAME.size
        if opcode == Opcode.STATISTICS and length >= _LENGTH.size:
            return int(_LENGTH.unpack_from(index, start)[0])
        start += length
    return None
