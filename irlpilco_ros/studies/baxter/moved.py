"""One demonstration, done at other places: at once, after a trial there, after trials elsewhere."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from itertools import islice
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy, MotionStoppedError
from irlpilco_ros.experience.practice import Forecast
from irlpilco_ros.learning import Iteration, LearningLoop, LearningSettings, Rollout, Task
from irlpilco_ros.learning.apprenticeship import apprenticeship
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.studies.baxter.baselines import PdTracking
from irlpilco_ros.studies.baxter.iterative_control import improved
from irlpilco_ros.studies.baxter.learning_run import JOINTS
from irlpilco_ros.studies.baxter.motion_bench import (
    BAXTER_JOINTS,
    PERIOD,
    MotionBench,
    Recording,
    sweep_settings,
)
from irlpilco_ros.studies.baxter.moved_bench import MovedBench, places
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.errors import ApproachError

EXPERIMENT = "moved"
MOVED_ROBOTS = ("default", "miscalibrated")

ITERATIONS = 4
"""Learned policies that are tried where it was shown, before the pile moves."""

PLACES, PRACTISED = 10, 5
"""Places that are tried at once, each from the trials where it was shown; at so many of them trials
are made then, one each, and the others tried again after each of those."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs."""
    return [moved_job(robot, seed) for seed in seeds for robot in MOVED_ROBOTS]


def moved_job(
    robot: str,
    seed: int,
    iterations: int = ITERATIONS,
    count: int = PLACES,
    practised: int = PRACTISED,
) -> Job:
    """Return the job of a robot of `ROBOTS`."""
    arguments = {
        "robot": robot,
        "settings": dataclasses.replace(sweep_settings(), seed=seed, threads=1),
        "iterations": iterations,
        "count": count,
        "practised": practised,
    }
    return Job(EXPERIMENT, robot, seed, moved_run, arguments)


def moved_run(
    robot: str, settings: LearningSettings, iterations: int, count: int, practised: int
) -> Result:
    """Learn the sweep where it was shown, and do it elsewhere.

    Returns:
        "places": of each place its "place" and, as `MotionBench.measured`, "replay", "tracking",
        "iterative" (all carried over), "at_once" and "after_one"; "predicted", "seconds" and
        "pieces" of the policy at once. "later": errors of the path at the places that were not
        practised [rad], after trials at 0, 1, ... others, (practised + 1, places).
    """
    bench = MovedBench(robot, settings.seed, PERIOD)
    trials: list[Rollout] = []

    def run(policy: Policy) -> Rollout:
        recording = bench.here.run(PolicyOf(BAXTER_JOINTS, policy))
        trials.append(bench.here.rollout(recording, PERIOD))
        return trials[-1]

    loop = apprenticeship(bench.here.task, settings, run)
    last = list(islice(loop, iterations + 1))[-1]
    speeds = _iterative_speeds(bench.here, iterations)
    drawn = places(settings.seed, count)
    benches = [bench.at(place) for place in drawn]
    tried = [
        _place(bench, there, place, _Learner(bench.here.task, settings, trials, last), speeds)
        for there, place in zip(benches, drawn, strict=True)
    ]
    learner = _Learner(bench.here.task, settings, trials, last)
    later = _practise(learner, benches[:practised], benches[practised:])
    return {"places": tried, "later": later}


class _Learner:
    """A run of learning that goes from place to place."""

    def __init__(
        self, task: Task, settings: LearningSettings, trials: Sequence[Rollout], last: Iteration
    ) -> None:
        self._task, self._settings = task, settings
        self._loop = LearningLoop(task, settings, trials, last)

    def adapt(self, there: MotionBench) -> Iteration:
        """Go on there, and return what to try first."""
        return self._loop.move(there.task)

    def peek(self, there: MotionBench) -> Iteration:
        """Return what would be tried there first, and stay."""
        loop = self._loop
        fork = LearningLoop(loop.task, self._settings, loop.trials, loop.last, None, loop.tasks)
        return fork.move(there.task)

    def attempt(self, there: MotionBench) -> dict[str, Any]:
        """Try what comes next, and learn from it; returns what it was like."""
        iteration = self._loop.propose()
        recording = there.run(PolicyOf(BAXTER_JOINTS, iteration.policy))
        self._loop.take(there.rollout(recording, PERIOD))
        return there.measured(recording)


def _place(
    bench: MovedBench,
    there: MotionBench,
    place: Sequence[float],
    learner: _Learner,
    speeds: Array,
) -> dict[str, Any]:
    """Return how it goes at a place, with what was learned where it was shown."""
    began = time.process_time()
    adapted = learner.adapt(there)
    seconds = time.process_time() - began
    forecast = Forecast.of(there.task, adapted, JOINTS)
    start = there.task.reference_states()[0, :JOINTS]
    faster = there.task.demonstrated_controls() - bench.here.task.demonstrated_controls()
    return {
        "place": list(place),
        **{
            name: _measured(there, policy)
            for name, policy in _baselines(there.task, speeds + faster).items()
        },
        "pieces": bench.pieces(place, PolicyOf(BAXTER_JOINTS, adapted.policy), start),
        "at_once": learner.attempt(there),
        "after_one": learner.attempt(there),
        "predicted": forecast.total,
        "seconds": seconds,
    }


def _baselines(task: Task, speeds: Array) -> dict[str, ActingPolicy]:
    """Return what stands beside it, by name; the last one with feed-forward speeds (H, J)."""
    return {
        "replay": open_loop_policy(task),
        "tracking": _tracking(task, task.demonstrated_controls()),
        "iterative": _tracking(task, speeds, 0.0),
    }


def _practise(
    learner: _Learner, practised: Sequence[MotionBench], others: Sequence[MotionBench]
) -> list[list[float]]:
    """Return errors of the path at the others [rad], before and after each trial elsewhere."""
    errors = [_errors(learner, others)]
    for there in practised:
        learner.adapt(there)
        learner.attempt(there)
        errors.append(_errors(learner, others))
    return errors


def _errors(learner: _Learner, others: Sequence[MotionBench]) -> list[float]:
    found = []
    for there in others:
        policy = PolicyOf(BAXTER_JOINTS, learner.peek(there).policy)
        found.append(float(there.measured(there.run(policy))["path"]))
    return found


def _iterative_speeds(bench: MotionBench, iterations: int) -> Array:
    """Return the feed-forward of iterative learning control after as many trials (H, J) [rad/s]."""
    speeds = bench.task.demonstrated_controls()
    for _ in range(iterations):
        trial: Recording = bench.run(_tracking(bench.task, speeds, 0.0))
        speeds = improved(bench, speeds, trial, 1.0)
    return speeds


def _tracking(task: Task, speeds: Array, gain: float = 1.0) -> PdTracking:
    """Return PD tracking about feed-forward speeds, or these alone."""
    states, limit = task.reference_states(), task.control_limit
    clipped = np.clip(speeds, -limit, limit)
    return PdTracking(states, clipped, limit, 2.0 * gain, 0.6 * gain)


def _measured(bench: MotionBench, policy: ActingPolicy) -> dict[str, Any] | None:
    """Return how a policy does; None if it was stopped."""
    try:
        return bench.measured(bench.run(policy))
    except (MotionStoppedError, ApproachError):
        return None
