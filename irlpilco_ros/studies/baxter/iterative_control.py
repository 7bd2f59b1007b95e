"""Iterative learning control: the oldest way to learn a motion by trials, without any model.

u[t] += g (e[t+1] - e[t]) / dt after every trial, e being how far the joints were behind what was
shown: whatever error grew during a period is made up for by that period's command of the next
trial (Arimoto, Kawamura & Miyazaki 1984). With feedback, PD tracking stands beside it in the trial.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import MotionStoppedError
from irlpilco_ros.learning import Task
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.studies.baxter.baselines import PdTracking
from irlpilco_ros.studies.baxter.learning_run import JOINTS
from irlpilco_ros.studies.baxter.motion_bench import (
    EXPERIMENT,
    ITERATIONS,
    PERIOD,
    MotionBench,
)
from irlpilco_ros.studies.baxter.motion_measure import Recording
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.errors import ApproachError

GAINS = (0.3, 0.5, 0.7, 1.0, 1.3)
"""Those that are tried; the best counts."""

WAYS = {"alone": (0.0, 0.0), "with_pd": (1.0, 0.3)}
"""Gains kp [1/s] and kd of the feedback beside it."""


def iterative_job(robot: str, seed: int, iterations: int = ITERATIONS) -> Job:
    """Return the job of iterative learning control on a robot of `ROBOTS`."""
    arguments = {"robot": robot, "seed": seed, "period": PERIOD, "iterations": iterations}
    return Job(EXPERIMENT, f"iterative_{robot}", seed, iterative_run, arguments)


def iterative_run(robot: str, seed: int, period: float, iterations: int) -> Result:
    """Learn with every gain; returns trials as `MotionBench.measured`, [gain][trial] of each way.

    Where a trial was stopped, because its motion got out of hand, there are no more of that gain.
    """
    bench = MotionBench(robot, seed, period)
    result: Result = {}
    for way, feedback in WAYS.items():
        first = bench.run(tracking(bench.task, bench.task.demonstrated_controls(), feedback))
        result[way] = [_trials(bench, first, gain, feedback, iterations) for gain in GAINS]
    return result


def _trials(
    bench: MotionBench,
    first: Recording,
    gain: float,
    feedback: tuple[float, float],
    iterations: int,
) -> list[dict[str, Any]]:
    speeds, trial = bench.task.demonstrated_controls(), first
    measured = [bench.measured(first)]
    for _ in range(iterations):
        speeds = improved(bench, speeds, trial, gain)
        try:
            trial = bench.run(tracking(bench.task, speeds, feedback))
        except (MotionStoppedError, ApproachError):
            break
        measured.append(bench.measured(trial))
    return measured


def improved(bench: MotionBench, speeds: Array, trial: Recording, gain: float) -> Array:
    """Return the next trial's feed-forward speeds (H, J) [rad/s]."""
    task = bench.task
    behind = (task.reference_states() - bench.rollout(trial, task.dt).states)[:, :JOINTS]
    better = speeds + gain * np.diff(behind, axis=0) / task.dt
    clipped: Array = np.clip(better, -task.control_limit, task.control_limit)
    return clipped


def best_iterative(runs: Sequence[Result], way: str, key: str = "path") -> Array:
    """Return an error of every run and trial (seeds, k), each with the best gain for that trial.

    The best gain has the least median over the runs. A trial that was not made counts as infinite.
    """
    count = max(len(trials) for run in runs for trials in run[way])
    errors = np.full((len(runs), len(GAINS), count), np.inf)
    for seed, run in enumerate(runs):
        for number, trials in enumerate(run[way]):
            errors[seed, number, : len(trials)] = [trial[key] for trial in trials]
    best = np.median(errors, axis=0).argmin(axis=0)
    chosen: Array = errors[:, best, np.arange(count)]
    return chosen


def tracking(task: Task, speeds: Array, feedback: tuple[float, float]) -> PdTracking:
    """Return what a trial sends: feed-forward speeds (H, J) [rad/s], and feedback of `WAYS`."""
    limit = task.control_limit
    return PdTracking(task.reference_states(), np.clip(speeds, -limit, limit), limit, *feedback)
