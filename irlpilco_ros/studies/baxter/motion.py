"""The motion that the arm makes, not its ticks alone: learned, replayed, iteratively controlled."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from irlpilco_ros.learning import Iteration, LearningSettings, Rollout, apprenticeship
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.studies.baxter.iterative_control import iterative_job
from irlpilco_ros.studies.baxter.learning_run import JOINTS
from irlpilco_ros.studies.baxter.motion_bench import (
    EXPERIMENT,
    ITERATIONS,
    PERIOD,
    MotionBench,
    sweep_settings,
)
from irlpilco_ros.studies.baxter.motion_measure import BAXTER_JOINTS, Recording
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.job import Job, Result

CONTROL_PERIOD = "control_period"
"""Name of the experiment with several of them."""


@dataclass(frozen=True)
class Rate:
    """How often to decide, and how large the model may become at that.

    Attributes:
        period: Control period [s].
        model_points: Largest number of points that the dynamics model consists of.
    """

    period: float
    model_points: int = sweep_settings().model_points


OTHER_RATES = {"0.5": Rate(0.5), "0.1": Rate(0.1), "0.1_200": Rate(0.1, 200)}
"""The other rates by their conditions: the fastest also with a cheaper model."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs: of learning first, then of what stands beside it."""
    learned = [motion_job(robot, seed) for seed in seeds for robot in ROBOTS]
    iterative = [iterative_job(robot, seed) for seed in seeds for robot in ROBOTS]
    return learned + iterative


def motion_job(robot: str, seed: int, iterations: int = ITERATIONS) -> Job:
    """Return the job of learning on a robot of `ROBOTS`."""
    return _job(EXPERIMENT, robot, robot, seed, Rate(PERIOD), iterations)


def control_period_jobs(seeds: Sequence[int]) -> list[Job]:
    """Return the jobs on the default robot: the usual ones, and those at other periods."""
    usual = [motion_job("default", seed) for seed in seeds]
    others = [
        _job(CONTROL_PERIOD, condition, "default", seed, rate, ITERATIONS)
        for seed in seeds
        for condition, rate in OTHER_RATES.items()
    ]
    return usual + others


def _job(
    experiment: str, condition: str, robot: str, seed: int, rate: Rate, iterations: int
) -> Job:
    settings = dataclasses.replace(
        sweep_settings(), seed=seed, threads=1, model_points=rate.model_points
    )
    arguments = {
        "robot": robot,
        "settings": settings,
        "period": rate.period,
        "iterations": iterations,
    }
    return Job(experiment, condition, seed, motion_run, arguments)


def motion_run(robot: str, settings: LearningSettings, period: float, iterations: int) -> Result:
    """Show the sweep, replay it, and learn it; returns what every motion was like.

    Args:
        robot: A key of `ROBOTS`.
        settings: How to learn; their seed is the robot's, too.
        period: Control period [s].
        iterations: Number of learned policies, each tried once.

    Returns:
        "demonstration" and "replay" as `MotionBench.measured`; "rows", the same of every trial,
        with what was predicted of it ("coverage", "prediction") and the computing before it, of
        one core ("seconds").
    """
    bench = MotionBench(robot, settings.seed, period)
    replay = bench.measured(bench.run(open_loop_policy(bench.task)))
    trials = _Trials(bench)
    loop = apprenticeship(bench.task, settings, trials.run)
    for iteration in islice(loop, iterations + 1):
        trials.rows[-1] |= _foretold(iteration, trials.last)
    return {
        "demonstration": bench.measured(bench.shown),
        "replay": replay,
        "rows": trials.rows,
    }


class _Trials:
    """Makes trials and measures them, and the computing between one and the next.

    Attributes:
        rows: What is known of each.
        last: The last one; that of the demonstration before there is one.
    """

    def __init__(self, bench: MotionBench) -> None:
        """Begin to measure."""
        self._bench = bench
        self._began = time.process_time()
        self.rows: list[dict[str, Any]] = []
        self.last = bench.shown

    def run(self, policy: Policy) -> Rollout:
        """Try a policy, and return what is learned from that."""
        seconds = time.process_time() - self._began
        bench = self._bench
        self.last = bench.run(PolicyOf(BAXTER_JOINTS, policy))
        self.rows.append({**bench.measured(self.last), "seconds": seconds})
        trial = bench.rollout(self.last, bench.task.dt)
        self._began = time.process_time()
        return trial


def _foretold(iteration: Iteration, recording: Recording) -> dict[str, Any]:
    """Return what the model said of a trial that came after it; nothing of the first one.

    "coverage" is the part of all measured positions at t = 1..H within two predicted standard
    deviations of what is measured; "prediction" the prediction's RMS error [rad].
    """
    if iteration.index == 0:
        return {}
    off = recording.rollout.states[1:, :JOINTS] - iteration.predicted_means[1:, :JOINTS]
    band = 2.0 * iteration.predicted_deviations[1:, :JOINTS]
    return {
        "coverage": float(np.mean(np.abs(off) < band)),
        "prediction": float(np.sqrt(np.mean(off**2))),
    }
