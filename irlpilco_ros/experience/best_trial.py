"""Which trial of a run is the best so far, and its policy in best_policy.yaml.

Trials are compared where the object is now: those at other places were of another motion.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable
from pathlib import Path

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.experience.metrics import MetricsRow
from irlpilco_ros.experience.places import iterations_here, read_places
from irlpilco_ros.experience.plain_files import open_regular, read_text
from irlpilco_ros.experience.run_directory import RunDirectory


def best_row(rows: Iterable[MetricsRow]) -> MetricsRow | None:
    """Return the iteration's row of least error (6.1), which learning minimises; None if none."""
    judged = [row for row in rows if row.iteration is not None and math.isfinite(row.mse)]
    return min(judged, key=lambda row: row.mse, default=None)


def rows_here(run: RunDirectory) -> list[MetricsRow]:
    """Return the rows of the iterations that were for where the object is now.

    Raises:
        RunDirectoryError: metrics.csv or a place cannot be read.
    """
    is_here = iterations_here(run.places_directory)
    rows = run.metrics()
    return [row for row in rows if row.iteration is not None and is_here(row.iteration)]


def keep_best_policy(run: RunDirectory) -> None:
    """Bring best_policy.yaml up to date: a copy of the best trial's policy file, whole at any time.

    Before the first trial where the object is now, it stays what it was elsewhere.

    Raises:
        FileError: the policy cannot be read, or the copy not be written.
        RunDirectoryError: metrics.csv or a place cannot be read.
    """
    best = best_row(rows_here(run))
    if best is None or best.iteration is None:
        return
    head = f"# {_words(best)}\n"
    if not _begins(run.best_policy_file, head.encode()):
        policy = read_text(run.policy_file(best.iteration))
        write_atomically(run.best_policy_file, (head + policy).encode())


def best_command(run: RunDirectory) -> str:
    """Return the command that runs the best policy so far; "" if no trial was judged yet."""
    best = best_row(rows_here(run))
    if best is None or best.iteration is None:
        return ""
    copy = run.best_policy_file
    return command_of(copy if copy.exists() else run.policy_file(best.iteration))


def command_of(policy: Path) -> str:
    """Return the command that runs the policy of a file without a learner."""
    return f"ros2 run irlpilco_ros controller --ros-args --params-file {shlex.quote(str(policy))}"


def best_sentence(run: RunDirectory) -> str:
    """Return a line that tells the best trial so far, and how to run its policy.

    Raises:
        RunDirectoryError: metrics.csv or a place cannot be read.
    """
    best = best_row(rows_here(run))
    if best is None:
        where = " where the object is now" if read_places(run.places_directory) else ""
        return f"best: no trial has been judged yet{where}"
    return f"best: {_words(best)}; run it: {best_command(run)}"


def _words(best: MetricsRow) -> str:
    error = f"{best.rmse_rad:.4f} rad off at the decisions"
    return f"iteration {best.iteration}, trial {best.trial:03d}, {error}"


def _begins(path: Path, head: bytes) -> bool:
    """Whether a file is there and begins so: the policy of a judged iteration never changes."""
    try:
        with open_regular(path) as stream:
            return stream.read(len(head)) == head
    except (FileError, OSError):
        return False
