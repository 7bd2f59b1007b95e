"""metrics.csv: one row for every trial of a run, for people, plots and spreadsheets."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError, RunDirectoryError
from irlpilco_ros.experience.path_quality import PathQuality
from irlpilco_ros.experience.plain_files import read_text

REPLAY = "replay"
"""What stands in the iteration column of the open-loop replay of the demonstration."""

DEMONSTRATION = "demonstration"
"""What stands in the iteration column of the demonstration itself."""


@dataclass(frozen=True)
class MetricsRow:
    """How one trial went.

    Attributes:
        iteration: Iteration k whose policy ran; 0 is the initial trial, None what `baseline` says.
        trial: Number of the trial's bag.
        rmse_rad: Root-mean-square joint error against the demonstration [rad].
        mse: Error (6.1) of the thesis, in squared units of the features.
        margin: Margin of the weight rule, NaN where there is none.
        cost: Predicted cost of the policy, NaN where there is none.
        robot_time_s: Robot time that learning had used when this trial was over [s].
        model_s: Computing time of the dynamics model [s].
        policy_s: Computing time of the policy search [s].
        path_rmse_rad: Root-mean-square joint error over the whole path [rad], not at the ticks
            alone; NaN, as the three below, for a bag that holds nothing but samples.
        path_max_rad: Largest joint error on the path [rad].
        acceleration_p99: 99 % of the joints' accelerations are below it [rad/s^2].
        acceleration_max: Largest acceleration of a joint [rad/s^2].
        baseline: What it is if it is no iteration: REPLAY or DEMONSTRATION.
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
    path_rmse_rad: float = math.nan
    path_max_rad: float = math.nan
    acceleration_p99: float = math.nan
    acceleration_max: float = math.nan
    baseline: str = dataclasses.field(default=REPLAY, kw_only=True)

    @property
    def name(self) -> str:
        """What stands in the iteration column."""
        return self.baseline if self.iteration is None else str(self.iteration)

    @property
    def error_rad(self) -> float:
        """How far off it was [rad]: on its whole path if that is known, else at the decisions."""
        return self.rmse_rad if math.isnan(self.path_rmse_rad) else self.path_rmse_rad


COLUMNS = tuple(f.name for f in dataclasses.fields(MetricsRow) if f.name != "baseline")
_NUMBERS = COLUMNS[2:]
_BEFORE = COLUMNS[:9]  # of runs that were begun when the path was not measured
_LIMIT = 1 << 24  # [bytes]


def with_path(row: MetricsRow, path: PathQuality) -> MetricsRow:
    """Return a row with what is known of the path."""
    return dataclasses.replace(
        row,
        path_rmse_rad=path.rmse,
        path_max_rad=path.largest,
        acceleration_p99=path.acceleration_p99,
        acceleration_max=path.acceleration_max,
    )


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
    columns = tuple(lines[0].split(",")) if lines else ()
    if columns not in (COLUMNS, _BEFORE):
        raise RunDirectoryError(f"{path} does not start with the columns {','.join(COLUMNS)}")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            rows.append(_parse(line, len(columns)))
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
    if any(other.name == row.name for other in rows):
        name = row.name if row.iteration is None else f"iteration {row.iteration}"
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
        writer.writerow([each.name, each.trial, *(repr(getattr(each, name)) for name in _NUMBERS)])
    write_atomically(path, stream.getvalue().encode())


def _parse(line: str, columns: int) -> MetricsRow:
    values = line.split(",")
    if len(values) != columns:
        raise ValueError(f"{len(values)} values for {columns} columns")
    numbers = map(float, values[2:])
    if values[0] in (REPLAY, DEMONSTRATION):
        return MetricsRow(None, int(values[1]), *numbers, baseline=values[0])
    return MetricsRow(int(values[0]), int(values[1]), *numbers)
