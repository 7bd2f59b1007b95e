"""What is learned from a trial, kept beside its bag: a long run is reopened without reading it all.

It counts as long as the bag is what it was, byte by byte, and is made anew otherwise.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_files import entries
from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import BagError, FileError
from irlpilco_ros.experience.plain_files import open_regular
from irlpilco_ros.learning.rollout import Rollout

_VERSION = 1
"""Of what is made of a bag: another number makes all of it anew."""

_LIMIT = 1 << 28
"""Largest bag, and largest file of a trial, that is kept or read here [bytes]."""

_PIECE = 1 << 20  # [bytes]


def kept_trial(kept: Path, bag: Path, how: str, read: Callable[[], Rollout], keep: bool) -> Rollout:
    """Return what is learned from a trial, from its bag or from what is kept of it.

    Args:
        kept: File that keeps it.
        bag: The bag, a folder.
        how: Everything else that it depends on.
        read: Reads it from the bag.
        keep: Whether it may be written.

    Raises:
        BagError: as `read`.
    """
    digest = _digest(bag, how)
    if digest is None:
        return read()
    found = _read(kept, digest)
    if found is None:
        found = read()
        if keep:
            _write(kept, digest, found)
    return found


def _digest(bag: Path, how: str) -> str | None:
    """Return a digest of all that a trial depends on, or None if the bag is not to be had."""
    digest = hashlib.sha256(f"{_VERSION} {how}\n".encode())
    size = 0
    try:
        for file in entries(bag):
            digest.update(f"{file.name}\n".encode())
            with open_regular(file) as stream:
                while piece := stream.read(_PIECE):
                    digest.update(piece)
                    size += len(piece)
                    if size > _LIMIT:
                        return None
            digest.update(f"{size}\n".encode())
    except (BagError, FileError, OSError, UnicodeError):
        return None  # whoever reads the bag says what is wrong with it
    return digest.hexdigest()


def _read(kept: Path, digest: str) -> Rollout | None:
    """Return what is kept of the very bag, None if nothing is."""
    try:
        with open_regular(kept) as stream:
            content = stream.read(_LIMIT)
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            if str(arrays["digest"]) != digest:
                return None
            return Rollout(arrays["states"], arrays["controls"])
    except Exception:  # numpy and zipfile raise whatever a damaged file makes them
        return None  # it is made anew


def _write(kept: Path, digest: str, rollout: Rollout) -> None:
    stream = io.BytesIO()
    np.savez(stream, digest=np.asarray(digest), states=rollout.states, controls=rollout.controls)
    with suppress(FileError):  # without it the bag is read again, and no more
        write_atomically(kept, stream.getvalue())
