"""A fresh folder for a run, without losing the run that was there."""

from __future__ import annotations

from itertools import count
from pathlib import Path


def keep_previous(run_directory: Path) -> Path | None:
    """Move an existing run out of the way: runs/demo becomes runs/demo.1, .2, ...

    Returns:
        Where the previous run is now, or None if there was none.
    """
    if not run_directory.exists():
        return None
    names = (run_directory.with_name(f"{run_directory.name}.{number}") for number in count(1))
    return run_directory.rename(next(name for name in names if not name.exists()))
