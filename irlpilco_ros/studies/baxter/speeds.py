"""Shown at one speed, done at others: at once, and after a trial at that speed."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from irlpilco_ros.learning import LearningLoop, LearningSettings
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.studies.baxter.motion_bench import sweep_settings
from irlpilco_ros.studies.baxter.places import PLACES_ROBOTS, Traveller
from irlpilco_ros.studies.baxter.places_bench import Place, PlacesBench
from irlpilco_ros.studies.job import Job, Result

EXPERIMENT = "speeds"
SPEEDS = (0.7, 1.3)
WHERE: dict[str, Place] = {"where it was shown": (0.0, 0.0, 0.0), "elsewhere": (0.05, -0.03, 0.2)}
PRACTICE = 3
"""Iterations at the shown speed, where it was shown, before another is asked for."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs."""
    return [speeds_job(robot, seed) for seed in seeds for robot in PLACES_ROBOTS]


def speeds_job(
    robot: str, seed: int, iterations: int = PRACTICE, speeds: Sequence[float] = SPEEDS
) -> Job:
    """Return the job of a robot of `ROBOTS`; arguments as `speeds_run`."""
    arguments = {
        "robot": robot,
        "settings": dataclasses.replace(sweep_settings(), seed=seed, threads=1),
        "iterations": iterations,
        "speeds": tuple(speeds),
    }
    return Job(EXPERIMENT, robot, seed, speeds_run, arguments)


def speeds_run(
    robot: str, settings: LearningSettings, iterations: int, speeds: Sequence[float]
) -> Result:
    """Learn the sweep as fast as it was shown, and do it slower and faster, there and elsewhere.

    Args:
        robot: A key of `ROBOTS`.
        settings: How to learn; their seed is the robot's, too.
        iterations: Learned policies that are tried at the shown speed.
        speeds: Times as fast as it was shown.

    Returns:
        "home", how the last trial at the shown speed went, and "rows": of each of `WHERE` and each
        speed, "where", "speed", and how "replay" of the demonstration's speeds went, the policy
        "at_once" and the one "after_one" trial; as `Traveller` tells it.
    """
    bench = PlacesBench(robot, settings.seed)
    learner = Traveller(bench, LearningLoop(bench.home.task, settings))
    home = [learner.at_home() for _ in range(iterations + 1)][-1]
    rows = []
    for where, place in WHERE.items():
        for speed in speeds:
            spot, there = bench.at(place, speed), learner.copy()
            row = {"where": where, "speed": speed, "at_once": there.at_once(spot)}
            row["after_one"] = there.again(spot)
            row["replay"] = bench.run(spot, open_loop_policy(spot.task))[1]
            rows.append(row)
    return {"home": home, "rows": rows}
