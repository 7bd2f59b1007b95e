"""Folders of recordings: their owner's alone, unless the umask says otherwise on purpose."""

from __future__ import annotations

import os
import stat
from pathlib import Path

EVERYBODYS = (0o755, 0o775)
"""What a folder gets from the umasks 022 and 002, which no user chose: systems set them."""


def make_private(path: Path) -> None:
    """Make a folder and those above it that are missing; one that is there stays as it is.

    With the umask 022 or 002, which everybody has, new folders are for their owner alone (0700).
    Any other umask, or a default ACL, is somebody's choice and decides.

    Raises:
        OSError: it cannot be made.
    """
    if os.path.isdir(path):
        return
    if not os.path.lexists(path.parent):
        make_private(path.parent)
    try:
        os.mkdir(path)
    except FileExistsError:  # somebody else was faster, or it is no folder
        if not os.path.isdir(path):
            raise
    else:
        if stat.S_IMODE(os.stat(path).st_mode) & 0o777 in EVERYBODYS:
            os.chmod(path, 0o700)
