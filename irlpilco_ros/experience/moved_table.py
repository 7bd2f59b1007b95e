"""moved.csv: how a motion went at the places to which its object was moved."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.experience.plain_files import read_yaml
from irlpilco_ros.learning.errors import InvalidSettingError

if TYPE_CHECKING:
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics


@dataclass(frozen=True)
class MovedRow:
    """One trial at a place; NaN where the place was refused.

    Attributes:
        place: Number of the place in the file, from 1.
        x: Where the object is, relative to where it was shown [m].
        y: Likewise [m].
        turn: How far it is turned [rad].
        trials_there: Trials at this place that the policy had learned from.
        rmse_rad: Root-mean-square joint error at the decisions [rad].
        path_rmse_rad: The same over the whole path [rad].
        tool_rmse_m: Root-mean-square distance of the tools from where they should be [m].
        predicted_rmse_rad: What the model expected, spread included [rad].
        pieces: Pieces in the pan.
        of_pieces: Pieces that lay there.
        adapt_s: Time that learner/adapt took [s].
        speed: How many times as fast as it was shown it was done.
    """

    place: int
    x: float
    y: float
    turn: float
    trials_there: int = 0
    rmse_rad: float = math.nan
    path_rmse_rad: float = math.nan
    tool_rmse_m: float = math.nan
    predicted_rmse_rad: float = math.nan
    pieces: int = 0
    of_pieces: int = 0
    adapt_s: float = math.nan
    speed: float = 1.0

    def line(self) -> str:
        """Return it as a readable line."""
        return (
            f"{self.place:>5}  {self.x:>6.3f}  {self.y:>6.3f}  {self.turn:>6.3f}  "
            f"{self.trials_there:>6}  {self.path_rmse_rad:>10.4f}  {self.rmse_rad:>11.4f}  "
            f"{self.tool_rmse_m:>9.4f}  {self.predicted_rmse_rad:>15.4f}  "
            f"{self.pieces:>3} of {self.of_pieces:<3}  {self.adapt_s:>9.1f}  {self.speed:>5.2f}"
        )


COLUMNS = tuple(field.name for field in dataclasses.fields(MovedRow))

HEADER = (
    "place   x [m]   y [m]  [rad]   trials  path [rad]  ticks [rad]  tools [m]  "
    "predicted [rad]  in the pan  adapt [s]  speed"
)
"""Heading of `MovedRow.line`."""


def write_moved(path: Path, rows: Sequence[MovedRow]) -> None:
    """Write all rows; the file is whole at any moment.

    Raises:
        FileError: it cannot be written.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(dataclasses.astuple(row) for row in rows)
    write_atomically(path, stream.getvalue().encode())


class Move(NamedTuple):
    """Where the object goes from where it was shown [m, m, rad], and how fast the motion is then.

    The speed is that of the motion, so many times that which was shown.
    """

    x: float
    y: float
    turn: float
    speed: float = 1.0

    @property
    def place(self) -> tuple[float, float, float]:
        """Where the object is."""
        return self.x, self.y, self.turn


def read_moves(path: Path) -> list[Move]:
    """Return the places in a YAML file: a list of [x, y, turn] or [x, y, turn, speed].

    Raises:
        InvalidSettingError: it cannot be read, or holds something else.
    """
    expected = (
        "expected a list of [x, y, turn], metres and radians from where it was shown, or of "
        "[x, y, turn, speed]"
    )
    try:
        found = read_yaml(path)
    except FileError as error:
        raise InvalidSettingError(f"cannot read the places: {error}") from error
    try:
        moves = [Move(*map(float, numbers)) for numbers in found]
    except (TypeError, ValueError) as error:
        raise InvalidSettingError(f"{path} holds no places: {error}; {expected}") from error
    if not moves or not np.isfinite(moves).all():
        raise InvalidSettingError(f"{path} holds no places; {expected}")
    return moves


def tool_rmse(kinematics: RobotKinematics, path: MotionPath, shown: MotionPath) -> float:
    """Return the RMS distance of the tools over a path from where they were shown [m]."""
    wanted = np.stack(
        [np.interp(path.times, shown.times, column) for column in shown.positions.T], axis=1
    )
    off = [
        kinematics.poses(reached)[:, :3, 3] - kinematics.poses(place)[:, :3, 3]
        for reached, place in zip(path.positions, wanted, strict=True)
    ]
    return float(np.sqrt(np.mean(np.sum(np.square(off), axis=2))))
