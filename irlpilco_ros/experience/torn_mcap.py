"""The records of an MCAP file up to its end, or up to the point where it is torn.

mcap's own readers want an index, or take a cut-off last record for a whole one; here a record
counts only if all its bytes are there and its checksum is right.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError, UnsupportedCompressionError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from irlpilco_ros.experience.errors import BagError

_HEADER = struct.Struct("<BQ")
_BROKEN = (McapError, CRCValidationError, struct.error, UnicodeDecodeError)
_SUMMARY = Opcode.DATA_END  # what follows it repeats what came before


@dataclass(frozen=True)
class McapContent:
    """What a file holds.

    Attributes:
        records: Schemas, channels, messages and metadata, in order of writing.
        torn_at: Number of bytes after which the file is torn, or None if it is whole.
    """

    records: tuple[McapRecord, ...]
    torn_at: int | None


def read_mcap(path: Path) -> McapContent:
    """Return all whole records of a file.

    Raises:
        BagError: the file cannot be read, is no MCAP file, or is compressed in a way that this
            installation cannot read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BagError(f"cannot read {path}: {error}") from error
    if not MCAP0_MAGIC.startswith(data[: len(MCAP0_MAGIC)]):
        raise BagError(f"{path} is no MCAP file: it does not start as one")
    records: list[McapRecord] = []
    intact = min(len(data), len(MCAP0_MAGIC))
    try:
        for opcode, payload, end in _frames(data):
            records.extend(_parse(opcode, payload))
            intact = end
            if opcode == _SUMMARY:
                break
    except UnsupportedCompressionError as error:
        raise BagError(f"cannot read {path}: {error}") from error
    except _BROKEN:
        return McapContent(tuple(records), intact)
    return McapContent(tuple(records), None if _is_closed(data) else intact)


def _frames(data: bytes) -> Iterator[tuple[int, bytes, int]]:
    """Yield opcode, payload and end of every record that is there with all its bytes."""
    start = len(MCAP0_MAGIC)
    while start + _HEADER.size <= len(data):
        opcode, length = _HEADER.unpack_from(data, start)
        end = start + _HEADER.size + length
        # A power failure can leave zeros where a record should be: 0 is no opcode.
        if opcode == 0 or end > len(data):
            return
        yield opcode, data[start + _HEADER.size : end], end
        start = end


def _parse(opcode: int, payload: bytes) -> list[McapRecord]:
    """Return what a record holds, with its checksum verified; nothing if it does not matter."""
    stream = ReadDataStream(BytesIO(payload))
    if opcode == Opcode.CHUNK:
        return breakup_chunk(Chunk.read(stream), validate_crc=True)
    if opcode == Opcode.MESSAGE:
        return [Message.read(stream, len(payload))]
    readers = {
        Opcode.SCHEMA: Schema.read,
        Opcode.CHANNEL: Channel.read,
        Opcode.METADATA: Metadata.read,
    }
    return [readers[Opcode(opcode)](stream)] if opcode in readers else []


def _is_closed(data: bytes) -> bool:
    """Whether the file ends as it should: a footer record, then the magic bytes again."""
    footer_size = _HEADER.size + 20
    ending = data[-len(MCAP0_MAGIC) - footer_size :]
    return (
        len(ending) == footer_size + len(MCAP0_MAGIC)
        and ending.endswith(MCAP0_MAGIC)
        and _HEADER.unpack_from(ending) == (Opcode.FOOTER, 20)
    )
