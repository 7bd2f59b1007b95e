"""The sweeps of a run, simulated again: which ones, how often, and what to say if it cannot be."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass, field

import numpy as np

from irlpilco_ros.experience import metrics
from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.report.courses import TRIAL
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
from sim_bridge.guided_motion import Guidable, GuidedMotion
from sim_bridge.recorded_motion import RecordedMotion

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
        films: pictures of the demonstration and of the best trial, by name; maybe none.
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
        motions = _motions(run)
        shown = {DEMONSTRATION: DEMONSTRATION, f"trial {run.best.index}": LEARNED}
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


def _motions(run: RunSummary) -> dict[str, Guidable]:
    """Return what is swept by: all that the robot did, or what was sampled of it.

    Between the samples of a bag that holds nothing else the arms go straight.
    """
    interval = float(run.times[1] - run.times[0])
    ways = {
        DEMONSTRATION: (metrics.DEMONSTRATION, run.demonstration),
        REPLAY: (metrics.REPLAY, run.replay),
        LEARNED: (TRIAL, run.best.trial),
    }
    motions: dict[str, Guidable] = {}
    for way, (name, sampled) in ways.items():
        done = run.courses.get(name)
        if done is not None:
            parts = (done.times, done.positions, done.velocities)
            motions[way] = RecordedMotion(run.joints, *parts)
        elif sampled is not None:
            motions[way] = GuidedMotion(run.joints, interval, sampled)
    return motions
