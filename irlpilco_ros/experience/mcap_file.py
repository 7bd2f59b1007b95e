"""An MCAP file that is written in chunks, for recordings without end.

mcap's own writer keeps half a kilobyte for each chunk and needs seconds to write them down in the
end; where every sample is on disk at once, there are a hundred chunks in a second. Here a chunk
costs the hundred bytes that its index has in the file.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import BinaryIO, NamedTuple

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

_FRAME = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK = struct.Struct("<QQQIIQ")  # no compression: its name is an empty string
_CHUNK_INDEX = struct.Struct("<QQQQI")
_CHUNK_SIZES = struct.Struct("<QIQQ")
_MESSAGE_INDEX = struct.Struct("<HI")
_ENTRY = struct.Struct("<QQ")
_PLACE = struct.Struct("<HQ")
_FOOTER_COVERED = struct.Struct("<BQQQ")


class ChunkMessage(NamedTuple):
    """A message as it is written."""

    channel_id: int
    log_time: int
    publish_time: int
    data: bytes


class McapFile:
    """Writes records to a stream; what is written is in the stream when a method returns.

    Attributes:
        message_count: Number of messages.
        first: Earliest log time [ns].
        last: Latest log time [ns].
    """

    def __init__(self, stream: BinaryIO, profile: str, library: str) -> None:
        """Begin the file."""
        self.message_count = 0
        self.first = self.last = 0
        self._stream = stream
        self._place = 0
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._pending: list[McapRecord] = []
        self._counts: Counter[int] = Counter()
        self._chunks = 0
        self._chunk_index = bytearray()
        self._metadata: list[MetadataIndex] = []
        self._write(MCAP0_MAGIC)
        self._write(_bytes_of(Header(profile, library)))

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write a metadata record."""
        record = _bytes_of(Metadata(name=name, metadata=dict(data)))
        self._metadata.append(MetadataIndex(offset=self._place, length=len(record), name=name))
        self._write(record)

    def add_schema(self, name: str, definition: bytes) -> int:
        """Announce a schema (ros2msg), which is written with the next messages; return its id."""
        schema = Schema(id=len(self._schemas) + 1, data=definition, encoding="ros2msg", name=name)
        self._schemas.append(schema)
        self._pending.append(schema)
        return int(schema.id)

    def add_channel(self, topic: str, schema_id: int, metadata: Mapping[str, str]) -> int:
        """Announce a channel, which is written with the next messages; return its id."""
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic,
            message_encoding="cdr",
            metadata=dict(metadata),
            schema_id=schema_id,
        )
        self._channels.append(channel)
        self._pending.append(channel)
        return int(channel.id)

    def add_messages(self, messages: Sequence[ChunkMessage]) -> None:
        """Write messages (at least one) as one chunk, with its index."""
        content = bytearray(b"".join(map(_bytes_of, self._pending)))
        entries: dict[int, bytearray] = {}
        for channel_id, log_time, publish_time, data in messages:
            entries.setdefault(channel_id, bytearray()).extend(_ENTRY.pack(log_time, len(content)))
            content += _FRAME.pack(Opcode.MESSAGE, _MESSAGE.size + len(data))
            content += _MESSAGE.pack(channel_id, 0, log_time, publish_time)
            content += data
        times = [message.log_time for message in messages]
        self._write_chunk(bytes(content), min(times), max(times), entries)
        self._pending.clear()
        self.first = min([*times, self.first] if self.message_count else times)
        self.last = max(*times, self.last)
        self.message_count += len(messages)
        self._counts.update(message.channel_id for message in messages)

    def finish(self) -> None:
        """Write what lets readers find everything, and end the file."""
        self._write(_bytes_of(DataEnd(self._crc)))
        start = self._place
        summary = bytearray()
        offsets: list[SummaryOffset] = []
        for opcode, records in (
            (Opcode.SCHEMA, b"".join(map(_bytes_of, self._schemas))),
            (Opcode.CHANNEL, b"".join(map(_bytes_of, self._channels))),
            (Opcode.STATISTICS, _bytes_of(self._statistics())),
            (Opcode.CHUNK_INDEX, self._chunk_index),
            (Opcode.METADATA_INDEX, b"".join(map(_bytes_of, self._metadata))),
        ):
            if records:
                offsets.append(SummaryOffset(opcode, start + len(summary), len(records)))
                summary += records
        offsets_start = start + len(summary)
        summary += b"".join(map(_bytes_of, offsets))
        covered = _FOOTER_COVERED.pack(Opcode.FOOTER, 20, start, offsets_start)
        crc = zlib.crc32(covered, zlib.crc32(summary))
        self._write(bytes(summary))
        self._write(_bytes_of(Footer(start, offsets_start, crc)))
        self._write(MCAP0_MAGIC)

    def _write_chunk(
        self, content: bytes, first: int, last: int, entries: Mapping[int, bytearray]
    ) -> None:
        """Write a chunk, the index of its messages, and remember where they are."""
        begin, head = self._place, _FRAME.size + _CHUNK.size
        checksum, size = zlib.crc32(content), len(content)
        self._write(
            _FRAME.pack(Opcode.CHUNK, _CHUNK.size + size)
            + _CHUNK.pack(first, last, size, checksum, 0, size)
            + content
        )
        index, places = bytearray(), bytearray()
        for channel_id, own in entries.items():
            places += _PLACE.pack(channel_id, self._place + len(index))
            index += _FRAME.pack(Opcode.MESSAGE_INDEX, _MESSAGE_INDEX.size + len(own))
            index += _MESSAGE_INDEX.pack(channel_id, len(own)) + own
        self._write(bytes(index))
        record = _CHUNK_INDEX.pack(first, last, begin, head + size, len(places)) + places
        record += _CHUNK_SIZES.pack(len(index), 0, size, size)
        self._chunk_index += _FRAME.pack(Opcode.CHUNK_INDEX, len(record)) + record
        self._chunks += 1

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=self._chunks,
            message_count=self.message_count,
            metadata_count=len(self._metadata),
            message_start_time=self.first,
            message_end_time=self.last,
            schema_count=len(self._schemas),
        )

    def _write(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._place += len(data)


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
