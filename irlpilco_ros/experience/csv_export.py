"""Episodes as tables that every spreadsheet and plotting tool reads."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.episodes import Episode


def write_csv(folder: Path, episodes: Sequence[Episode]) -> list[Path]:
    """Write one file for each episode: a row for each joint state that was recorded.

    Columns: time [s], then `JOINT position` [rad], `JOINT velocity` [rad/s] and `JOINT command` of
    every joint; a command is empty where there was none.

    Returns:
        The files.

    Raises:
        FileError: one cannot be written.
    """
    paths = []
    for episode in episodes:
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        kinds = ("position", "velocity", "command")
        writer.writerow(
            ["time", *(f"{joint} {kind}" for kind in kinds for joint in episode.joints)]
        )
        rows = np.hstack(
            [episode.times[:, None], episode.positions, episode.velocities, episode.commands]
        )
        writer.writerows(
            [f"{value:.9g}" if np.isfinite(value) else "" for value in row] for row in rows
        )
        paths.append(folder / f"{episode.name}.csv")
        write_atomically(paths[-1], stream.getvalue().encode())
    return paths
