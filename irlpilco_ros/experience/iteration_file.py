"""What one iteration found, as npz: numbers and words only, nothing that could run."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError, RunDirectoryError
from irlpilco_ros.experience.plain_files import open_regular
from irlpilco_ros.learning.iteration import Iteration

_LIMIT = 1 << 28
"""Largest size of all arrays of a file [bytes]; an iteration has some megabytes."""


def write_iteration_file(path: Path, iteration: Iteration) -> None:
    """Write an iteration.

    Raises:
        FileError: it cannot be written, for example because the disk is full.
    """
    stream = io.BytesIO()
    arrays: dict[str, Any] = iteration.to_arrays()
    np.savez(stream, **arrays)
    write_atomically(path, stream.getvalue())


def read_iteration_file(path: Path) -> Iteration:
    """Return an iteration.

    Raises:
        RunDirectoryError: the file is not there, or holds something else.
    """
    try:
        with open_regular(path) as file:
            with zipfile.ZipFile(file) as archive:
                size = sum(entry.file_size for entry in archive.infolist())
            if size > _LIMIT:
                raise ValueError(f"it unpacks to {size} bytes; up to {_LIMIT} are read")
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                return Iteration.from_arrays(dict(arrays))
    except FileError as error:
        raise RunDirectoryError(str(error)) from error
    except Exception as error:  # numpy and zipfile raise whatever a damaged file makes them
        raise RunDirectoryError(f"cannot read the iteration {path}: {error!r}") from error
