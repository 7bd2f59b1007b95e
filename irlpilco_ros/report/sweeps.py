"""The sweeps of a run, simulated again: which ones, how often, and what to say if it cannot be."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass, field

import numpy as np

from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.report.debris_figure import DEMONSTRATION, LEARNED, REPLAY
from irlpilco_ros.report.resimulation import (
    PIECES,
    Film,
    can_resimulate,
    can_sweep,
    count_debris,
    film,
)
from irlpilco_ros.report.run_summary import DebrisCount, RunSummary
from sim_bridge.guided_motion import GuidedMotion

DEBRIS_SEEDS = tuple(range(6))
FILM_SEED = 1

NOT_THIS_ROBOT = (
    "Pictures of the motion are left out: the joints of this run are not those of the simulated "
    "Baxter."
)
NO_MUJOCO = "Pictures and debris are left out: MuJoCo is not installed (pip install mujoco)."


@dataclass(frozen=True)
class SimulatedSweeps:
    """What came out.

    Attributes:
        debris: the counts, or None.
        films: pictures of the demonstration and of the latest trial, by name; maybe none.
        notes: what could not be made, and what to do about it.
    """

    debris: DebrisCount | None = None
    films: dict[str, Film] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class SweepJobs:
    """Sweeps that other processes simulate meanwhile.

    Attributes:
        films: by name.
        counts: for each way of sweeping, one for each of `DEBRIS_SEEDS`; none with one arm, which
            cannot sweep.
    """

    films: dict[str, Future[Film]]
    counts: dict[str, list[Future[int]]]

    @classmethod
    def submit(cls, run: RunSummary, pool: Executor) -> SweepJobs:
        """Begin with the simulation of a run's sweeps; of another robot, of none."""
        if not can_resimulate(run.joints):
            return cls({}, {})
        interval = float(run.times[1] - run.times[0])
        ways = {DEMONSTRATION: run.demonstration, REPLAY: run.replay, LEARNED: run.last.trial}
        motions = {
            way: GuidedMotion(run.joints, interval, positions)
            for way, positions in ways.items()
            if positions is not None
        }
        shown = {DEMONSTRATION: DEMONSTRATION, f"trial {run.last.index}": LEARNED}
        films = {name: pool.submit(film, motions[way], FILM_SEED) for name, way in shown.items()}
        counts = {
            way: [pool.submit(count_debris, motion, seed) for seed in DEBRIS_SEEDS]
            for way, motion in motions.items()
            if can_sweep(run.joints)
        }
        return cls(films, counts)

    def results(self, tell: Callable[[float], None]) -> SimulatedSweeps:
        """Wait for the results; what cannot be made here becomes a note.

        Args:
            tell: Called with the fraction done, 0..1.
        """
        if not self.films:
            return SimulatedSweeps(notes=(NOT_THIS_ROBOT,))
        films: dict[str, Film] = {}
        notes: tuple[str, ...] = ()
        try:
            films = {name: job.result() for name, job in self.films.items()}
        except ImportError:
            return SimulatedSweeps(notes=(NO_MUJOCO,))
        except (IrlPilcoError, BrokenExecutor) as error:
            notes = (f"Pictures are left out: {error}.",)
        try:
            return SimulatedSweeps(self._debris(tell), films, notes)
        except (IrlPilcoError, BrokenExecutor) as error:
            return SimulatedSweeps(None, films, (*notes, f"Debris is left out: {error}."))

    def _debris(self, tell: Callable[[float], None]) -> DebrisCount | None:
        if not self.counts:
            return None
        counts = {}
        for number, (way, jobs) in enumerate(self.counts.items()):
            tell(number / len(self.counts))
            counts[way] = np.array([job.result() for job in jobs])
        return DebrisCount(DEBRIS_SEEDS, PIECES, counts)
