"""Files that are whole or not there at all, whatever kills the process."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from irlpilco_ros.experience.errors import FileError


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that a reader finds the old content or the new one, never a mixture.

    When it returns, the new content is on disk.

    Raises:
        FileError: it cannot be written, for example because the disk is full; the old content
            stays.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
        sync_directory(path.parent)
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def remove_leftovers(directory: Path) -> None:
    """Remove what processes that were killed in `write_atomically` left; nobody may be in it."""
    for leftover in directory.glob(".*.tmp"):
        if leftover.is_file():
            leftover.unlink()


def sync_directory(path: Path) -> None:
    """Bring the names in a directory to disk: without it a new file may vanish with the power."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_tree(path: Path) -> None:
    """Bring every file and name below a directory to disk."""
    for entry in path.rglob("*"):
        if entry.is_file():
            with entry.open("rb") as stream:
                os.fsync(stream.fileno())
    for directory in (path, *(entry for entry in path.rglob("*") if entry.is_dir())):
        sync_directory(directory)
