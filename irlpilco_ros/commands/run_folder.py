"""A fresh folder for a run, without losing the run that was there, or touching what is none."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.run_directory import RunDirectory


def keep_previous(run_directory: Path) -> Path | None:
    """Move an existing run out of the way: runs/demo becomes runs/demo.1, .2, ...

    Returns:
        Where the previous run is now, or None if there was none; an empty folder is none.

    Raises:
        RunDirectoryError: what is there is no run, or the current folder is in it. It stays as it
            is.
    """
    if not run_directory.exists():
        return None
    remedy = "it stays as it is; name another folder with --run-directory"
    here, run = Path.cwd().resolve(), run_directory.resolve()
    if here == run or run in here.parents:
        raise RunDirectoryError(f"the current folder is in {run_directory}: {remedy}")
    if run.is_dir() and not any(run.iterdir()):
        return None
    if not _is_run(run_directory):
        raise RunDirectoryError(f"{run_directory} is there and is no run: {remedy}")
    names = (run_directory.with_name(f"{run_directory.name}.{number}") for number in count(1))
    return run_directory.rename(next(name for name in names if not name.exists()))


def _is_run(path: Path) -> bool:
    """Return whether the folder is a run, or what a demo leaves that ended before it was one."""
    if not path.is_dir():
        return False
    try:
        return {"joints", "horizon", "imitation"} <= RunDirectory(path).configuration().keys()
    except RunDirectoryError:
        names = {each.name for each in path.iterdir()}
        return names <= {"log", "recordings"} and (path / "log" / "learner.log").is_file()
