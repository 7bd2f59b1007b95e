"""Unpacking with a bound: a few bytes can be made that unpack to more than a computer holds."""

from __future__ import annotations

import bz2
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import BinaryIO

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.plain_files import open_regular

LIMIT = 1 << 27
"""Largest chunk, message or other record that is unpacked [bytes]."""

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"

_RATIO = 2000  # nothing recorded by a robot shrinks more, but for what is nearly all zeros ...
_SPARE = 1 << 24  # ... and small [bytes]
_PIECE = 1 << 20


def decompress(compression: str, data: bytes | memoryview, size: int, where: str) -> bytes:
    """Return what is unpacked of a chunk: `size` bytes, or what is there if its end is not.

    Args:
        compression: zstd, lz4, bz2, or nothing.
        data: The packed bytes.
        size: How many bytes the chunk says that it unpacks to; at most one more is returned.
        where: What file this is, for messages.

    Raises:
        BagError: `size` is above the limit.
        ValueError: the data are damaged, or the compression is unknown.
    """
    if size > LIMIT:
        raise BagError(f"{where} unpacks to {size} bytes at once; up to {LIMIT} are read")
    if compression in ("", "none"):
        return bytes(data[: size + 1])
    try:
        if compression == "zstd":
            return bytes(zstandard.ZstdDecompressor().stream_reader(data).read(size + 1))
        if compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(bytes(data), size + 1))
        if compression == "bz2":
            return bz2.BZ2Decompressor().decompress(bytes(data), size + 1)
    except (zstandard.ZstdError, RuntimeError, OSError, EOFError) as error:
        raise ValueError(f"it cannot be unpacked: {error}") from error
    raise ValueError(f"it is compressed by {compression!r}; known are zstd, lz4 and bz2")


def message_content(data: bytes, where: str) -> bytes:
    """Return a message as it was before rosbag2 compressed it by itself, if it did.

    Raises:
        BagError: it cannot be unpacked.
    """
    # A serialised message starts with its encoding, never with these bytes.
    if data[:4] != ZSTD_MAGIC:
        return data
    try:
        content = decompress("zstd", data, LIMIT, where)
    except ValueError as error:
        raise BagError(f"a message in {where} is damaged: {error}") from error
    if len(content) > LIMIT:
        raise BagError(f"a message in {where} unpacks to more than {LIMIT} bytes")
    return content


class _Bounded(io.RawIOBase):
    """An unpacked file, read forwards: an end that is not there ends it, a bomb is refused."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._packed = open_regular(path)
        self._reader = zstandard.ZstdDecompressor().stream_reader(
            self._packed, read_across_frames=True
        )
        self._count = 0

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        try:
            count = self._reader.readinto(buffer)
        except zstandard.ZstdError as error:
            raise BagError(f"{self._path} is damaged: {error}") from error
        self._count += count
        if self._count > _RATIO * self._packed.tell() + _SPARE:
            raise BagError(
                f"{self._path} unpacks to more than {_RATIO} times its size; it is not read"
            )
        return count

    def close(self) -> None:
        self._packed.close()
        super().close()


def open_unpacked(path: Path) -> BinaryIO:
    """Open a file for reading forwards, unpacked if its name ends in .zstd.

    Raises:
        FileError: it is not there, or no regular file.
    """
    if path.suffix != ".zstd":
        return open_regular(path)
    return io.BufferedReader(_Bounded(path), _PIECE)


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Give a file for readers that want one on disk: itself, or unpacked in a temporary place.

    Raises:
        BagError: it cannot be unpacked.
        FileError: it is not there, or no regular file.
    """
    if path.suffix != ".zstd":
        open_regular(path).close()
        yield path
        return
    with NamedTemporaryFile(suffix=Path(path.stem).suffix) as file:
        with open_unpacked(path) as stream:
            try:
                while piece := stream.read(_PIECE):
                    file.write(piece)
                file.flush()
            except OSError as error:
                raise BagError(f"cannot unpack {path} to {file.name}: {error.strerror}") from error
        yield Path(file.name)
