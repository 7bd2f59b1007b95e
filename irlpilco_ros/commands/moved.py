"""The part of `irlpilco demo` in which the pile moves, and the sweep goes where it lies."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from irlpilco_ros.commands.number_options import whole
from irlpilco_ros.commands.settings_files import settings_paths
from irlpilco_ros.commands.terminal import ProgressDisplay
from irlpilco_ros.experience.metrics import MetricsRow
from irlpilco_ros.experience.moved_table import (
    HEADER,
    MovedRow,
    read_moves,
    tool_rmse,
    write_moved,
)
from irlpilco_ros.experience.object_pose import displacement, recorded_object_pose
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.path_quality import MotionPath, path_of
from irlpilco_ros.experience.places import Place, read_places
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.report.moved_pictures import Swept, moved_animation
from irlpilco_ros.report.resimulation import PIECES, count_debris
from sim_bridge.guided_motion import GuidedMotion

if TYPE_CHECKING:
    from irlpilco_ros.ros.session import Session

ADAPT_TIMEOUT = 300.0
"""How long the learner may take to adapt [s]; some seconds on a computer that is not busy."""

_ASKED = np.array([0.03, 0.03, 0.15])
"""By which what a camera tells may differ from where the pile was laid [m, m, rad]."""

_SHOWN = (0.0, 0.0, 0.0)

_TRIES = 2  # the learner may not have heard of the new pose yet


def add_moved_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --moved and --moved-trials."""
    group = parser.add_argument_group("the object moves")
    group.add_argument(
        "--moved",
        type=Path,
        metavar="FILE",
        help="after the iterations, move the pile to each place in turn, adapt, and sweep there; a "
        "YAML list of [x, y, turn], metres and radians from where it was shown, such as "
        "config/places.yaml; a fourth number is how many times as fast it is swept there",
    )
    group.add_argument(
        "--moved-trials",
        type=whole(0),
        default=0,
        metavar="N",
        help="further trials of learning at each place (default: 0)",
    )


class MovedDemo:
    """The demo at other places, once it has learned where it was shown."""

    def __init__(
        self,
        arguments: argparse.Namespace,
        directory: RunDirectory,
        session: Session,
        check: Callable[[], None],
        learn: Callable[[], None],
    ) -> None:
        """Do nothing yet.

        Args:
            arguments: The command line.
            directory: The run directory.
            session: A node to call the others with.
            check: Raises if one of the nodes has ended.
            learn: Makes one trial of learning.
        """
        self._directory, self._session = directory, session
        self._check, self._learn = check, learn
        self._moves = read_moves(arguments.moved)
        self._trials = 1 + int(arguments.moved_trials)
        self._seed = int(arguments.seed)
        values = load_parameters_file(settings_paths(arguments)[0], "learner")
        self._robot = settings_from_parameters(RobotSettings, values)
        tools = settings_from_parameters(ToolSettings, values)
        self._kinematics = kinematics_of(tools, self._robot.joints)
        self._rows: list[MovedRow] = []
        self._swept: list[Swept] = []

    def run(self) -> None:
        """Go to every place; a printed row for each trial, and all of them in RUN/moved.csv.

        RUN/moved.webp shows the first of them beside the last trial where it was learned.
        """
        print(HEADER, flush=True)
        self._keep(self._directory.metrics()[-1], _SHOWN)
        for number, move in enumerate(self._moves, start=1):
            place, where = move.place, move._asdict()
            self._lay(place)
            self._set("learner", {"speed": move.speed})
            began = time.perf_counter()
            refusal = self._adapt(place)
            seconds = time.perf_counter() - began
            if refusal:
                print(f"{number:>5}  refused: {refusal}", flush=True)
                self._add(MovedRow(number, **where, adapt_s=seconds))
                continue
            for trials in range(self._trials):
                self._lay(place)
                self._learn()
                row = self._directory.metrics()[-1]
                values = {**where, "trials_there": trials, "adapt_s": seconds}
                self._add(MovedRow(number, **values, **self._measured(row, place)))
                print(self._rows[-1].line(), flush=True)
                if not trials:
                    self._keep(row, place)
        self._draw()

    def _keep(self, row: MetricsRow, place: tuple[float, float, float]) -> None:
        """Keep a trial for the pictures, if its path was recorded."""
        path = self._path(row)
        if path is not None:
            self._swept.append(Swept(self._guided(path), place))

    def _draw(self) -> None:
        """Write RUN/moved.webp, or say why it is left out."""
        file = self._directory.path / "moved.webp"
        try:
            file.write_bytes(moved_animation(self._swept, self._seed))
        except (IrlPilcoError, BrokenExecutor) as error:
            print(f"{file} is left out: {error}")
        else:
            print(f"pictures: {file}")

    def _add(self, row: MovedRow) -> None:
        self._rows.append(row)
        write_moved(self._directory.path / "moved.csv", self._rows)

    def _lay(self, place: tuple[float, float, float]) -> None:
        """Lay the pile there, whole."""
        self._set("baxter_simulator", {"object_place": [float(each) for each in place]})

    def _set(self, node: str, values: dict[str, Any]) -> None:
        self._session.run(self._session.clients.set_parameters(node, values), self._check)

    def _adapt(self, place: tuple[float, float, float]) -> str:
        """Have the learner adapt to where the pile lies; return why it refuses, if it does."""
        from irlpilco_ros.ros.clients import RefusedError, ServiceError

        with ProgressDisplay("adapt") as display:
            display.update("adapt", 0.0)
            refusal = ""
            for _ in range(_TRIES):
                try:
                    self._session.trigger("learner/adapt", ADAPT_TIMEOUT, self._check)
                    refusal = ""
                except RefusedError as error:
                    refusal = str(error)
                if not refusal and self._is_there(place):
                    return ""
                self._lay(place)
        if refusal:
            return refusal
        raise ServiceError(f"the learner has not heard that the object is at {place}")

    def _is_there(self, place: tuple[float, float, float]) -> bool:
        before = recorded_object_pose(self._directory.demonstration_directory)
        assert before is not None  # or it would have been refused
        now = self._place().object_pose
        assert now is not None  # the simulator tells it
        off = np.subtract(displacement(before, now), place)
        return bool((np.abs(off) <= _ASKED).all())

    def _place(self) -> Place:
        return read_places(self._directory.places_directory)[-1]

    def _path(self, row: MetricsRow) -> MotionPath | None:
        recorded = self._directory.read_path(self._directory.trials_directory / f"{row.trial:03d}")
        decided = recorded.stamps[recorded.commanded]
        return path_of(recorded, self._robot.roles, decided[0], decided[-1] - decided[0])

    def _guided(self, path: MotionPath) -> GuidedMotion:
        interval = float(np.median(np.diff(path.times)))
        every = max(1, round(0.05 / interval))
        return GuidedMotion(self._robot.joints, every * interval, path.positions[::every])

    def _measured(self, row: MetricsRow, place: tuple[float, float, float]) -> dict[str, Any]:
        """Return what is told of a trial, by the columns of moved.csv."""
        shown = self._place().shown[0]
        path = self._path(row)
        measured: dict[str, Any] = {
            "rmse_rad": row.rmse_rad,
            "path_rmse_rad": row.path_rmse_rad,
            "predicted_rmse_rad": self._predicted(row, shown.rollout.states),
        }
        if path is None:
            return measured
        samples = shown.samples
        times = samples.stamps - samples.stamps[0] - shown.begin
        wanted = MotionPath(times, samples.positions, samples.velocities)
        return {
            **measured,
            "tool_rmse_m": tool_rmse(self._kinematics, path, wanted),
            "pieces": count_debris(self._guided(path), self._seed, place),
            "of_pieces": PIECES,
        }

    def _predicted(self, row: MetricsRow, shown: np.ndarray) -> float:
        """Return the RMS error that was expected of a trial, spread included [rad]."""
        if not row.iteration:
            return math.nan
        found, count = self._directory.read_iteration(row.iteration), len(self._robot.joints)
        off = (found.predicted_means - shown)[1:, :count]
        variances = np.diagonal(found.predicted_covariances, axis1=1, axis2=2)[1:, :count]
        return float(np.sqrt(np.mean(off**2 + variances)))
