"""metrics.csv: one row for every trial of a run, for people, plots and spreadsheets."""

from __future__ import annotations

import csv
import dataclasses
import io
import os
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError, RunDirectoryError
from irlpilco_ros.experience.plain_files import read_text

REPLAY = "replay"
"""What stands in the iteration column of the open-loop replay of the demonstration."""


@dataclass(frozen=True)
class MetricsRow:
    """How one trial went.

    Attributes:
        iteration: Iteration k whose policy ran; 0 is the initial trial, None the replay baseline.
        trial: Number of the trial's bag.
        rmse_rad: Root-mean-square joint error against the demonstration [rad].
        mse: Error (6.1) of the thesis, in squared units of the features.
        margin: Margin of the weight rule, NaN where there is none.
        cost: Predicted cost of the policy, NaN where there is none.
        robot_time_s: Robot time that learning had used when this trial was over [s].
        model_s: Computing time of the dynamics model [s].
        policy_s: Computing time of the policy search [s].
    """

    iteration: int | None
    trial: int
    rmse_rad: float
    mse: float
    margin: float
    cost: float
    robot_time_s: float
    model_s: float
    policy_s: float


COLUMNS = tuple(field.name for field in dataclasses.fields(MetricsRow))
_NUMBERS = COLUMNS[2:]
_LIMIT = 1 << 24  # [bytes]


def read_metrics(path: Path) -> tuple[MetricsRow, ...]:
    """Return the rows of metrics.csv, none if there is no such file.

    A torn last line, as an editor or a full disk may leave it, is passed over.

    Raises:
        RunDirectoryError: the file has other columns, or a line inside it makes no sense.
    """
    if not os.path.lexists(path):
        return ()
    try:
        lines = read_text(path, _LIMIT).splitlines()
    except FileError as error:
        raise RunDirectoryError(str(error)) from error
    if not lines or tuple(lines[0].split(",")) != COLUMNS:
        raise RunDirectoryError(f"{path} does not start with the columns {','.join(COLUMNS)}")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            rows.append(_parse(line))
        except ValueError as error:
            if number == len(lines):
                break
            raise RunDirectoryError(f"{path}, line {number}: {line!r} is no row: {error}") from None
    return tuple(rows)


def append_metrics(path: Path, row: MetricsRow) -> None:
    """Add a row to metrics.csv, so that the file is whole at any moment.

    Raises:
        RunDirectoryError: there is a row for this iteration already.
    """
    rows = read_metrics(path)
    if any(other.iteration == row.iteration for other in rows):
        name = REPLAY if row.iteration is None else f"iteration {row.iteration}"
        raise RunDirectoryError(f"{path} has a row for {name} already; rows are never replaced")
    _write(path, (*rows, row))


def withdraw_metrics(path: Path, iteration: int) -> Path:
    """Take back the rows of an iteration and of those after it.

    Returns:
        Where the file as it was is kept, beside it.

    Raises:
        RunDirectoryError: as `read_metrics`.
        FileError: it cannot be written.
    """
    rows = read_metrics(path)
    kept = next(
        name
        for number in count(1)
        if not (name := path.with_name(f"{path.stem}.withdrawn.{number}{path.suffix}")).exists()
    )
    _write(kept, rows)
    _write(path, [row for row in rows if row.iteration is None or row.iteration < iteration])
    return kept


def _write(path: Path, rows: Iterable[MetricsRow]) -> None:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for each in rows:
        first = REPLAY if each.iteration is None else each.iteration
        writer.writerow([first, each.trial, *(repr(getattr(each, name)) for name in _NUMBERS)])
    write_atomically(path, stream.getvalue().encode())


def _parse(line: str) -> MetricsRow:
    values = line.split(",")
    if len(values) != len(COLUMNS):
        raise ValueError(f"{len(values)} values for {len(COLUMNS)} columns")
    iteration = None if values[0] == REPLAY else int(values[0])
    return MetricsRow(iteration, int(values[1]), *(float(value) for value in values[2:]))
