"""Shown at one place, done at others: at once, after a trial there, after trials elsewhere."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from typing import Any, Self

from irlpilco_ros.experience.practice import Forecast
from irlpilco_ros.learning import Iteration, LearningLoop, LearningSettings
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.studies.baxter.carried_baselines import baselines_job
from irlpilco_ros.studies.baxter.learning_run import JOINTS
from irlpilco_ros.studies.baxter.motion_bench import ITERATIONS, PERIOD, sweep_settings
from irlpilco_ros.studies.baxter.motion_measure import BAXTER_JOINTS
from irlpilco_ros.studies.baxter.places_bench import (
    Place,
    PlacesBench,
    Spot,
    places_from,
)
from irlpilco_ros.studies.job import Job, Result

EXPERIMENT = "places"
PLACES_ROBOTS = ("default", "miscalibrated")

PRACTISED = 5
"""One trial is made at each of so many places, one after the other; the others are held out."""

WATCHED = 3
"""So many of these are tried at once after each of those trials, and once more after one there."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs, seed after seed: of learning, and of what stands beside it."""
    makers = (places_job, baselines_job)
    return [make(robot, seed) for seed in seeds for make in makers for robot in PLACES_ROBOTS]


def places_job(
    robot: str,
    seed: int,
    iterations: int = ITERATIONS,
    places: Sequence[Place] | None = None,
    practised: int = PRACTISED,
    watched: int = WATCHED,
) -> Job:
    """Return the job of learning on a robot of `ROBOTS`; arguments as `places_run`.

    If no places are given they are those of the study, beginning elsewhere with every seed, so that
    four seeds practise at all of them.
    """
    if places is None:
        places = places_from(PRACTISED * seed)
    arguments = {
        "robot": robot,
        "settings": dataclasses.replace(sweep_settings(), seed=seed, threads=1),
        "iterations": iterations,
        "places": tuple(places),
        "practised": practised,
        "watched": watched,
    }
    return Job(EXPERIMENT, robot, seed, places_run, arguments)


def places_run(
    robot: str,
    settings: LearningSettings,
    iterations: int,
    places: Sequence[Place],
    practised: int,
    watched: int,
) -> Result:
    """Learn the sweep where it was shown, and do it elsewhere.

    Args:
        robot: A key of `ROBOTS`.
        settings: How to learn; their seed is the robot's, too.
        iterations: Learned policies that are tried where it was shown, before the pile moves.
        places: Where the pile lies then.
        practised: Trials are made at so many of these, the first ones, in turn.
        watched: So many after these are tried after each such trial.

    Returns:
        "home", how the last trial went where it was shown. "places": of each its "place", and how
        it went "at_once" after the trials at home; of those watched "after_one" as well, with a
        trial there before. "practised": after each further trial elsewhere, the trials at once at
        those watched. "refused": the places where it cannot be done, with the "reason"; they are
        left out. A trial is told as `PlacesBench.run` does, with the error that was predicted
        ("predicted", spread included) and the computing on one core ("seconds").
    """
    bench = PlacesBench(robot, settings.seed)
    learner = Traveller(bench, LearningLoop(bench.home.task, settings))
    home = [learner.at_home() for _ in range(iterations + 1)][-1]
    spots, refused = bench.spots(places)
    watch = spots[practised : practised + watched]
    rows = []
    for spot in spots:
        there = learner.copy()
        row: dict[str, Any] = {"place": list(spot.place), "at_once": there.at_once(spot)}
        if spot in watch:
            row["after_one"] = there.again(spot)
        rows.append(row)
    later = []
    for spot in spots[:practised]:
        learner.at_once(spot)
        later.append([learner.copy().at_once(each) for each in watch])
    return {"home": home, "places": rows, "practised": later, "refused": refused}


class Traveller:
    """A run of learning that goes from place to place."""

    def __init__(self, bench: PlacesBench, loop: LearningLoop) -> None:
        """Begin where the sweep was shown, or go on."""
        self._bench, self._loop = bench, loop

    def copy(self) -> Self:
        """Return another one that has made the same trials."""
        own = self._loop
        loop = LearningLoop(own.task, own.settings, own.trials, own.last, own.best, own.tasks)
        return type(self)(self._bench, loop)

    def at_home(self) -> dict[str, Any]:
        """Learn, and try it where it was shown."""
        home = self._bench.home
        policy = self._loop.propose().policy
        recording = home.run(PolicyOf(BAXTER_JOINTS, policy))
        self._loop.take(home.rollout(recording, PERIOD))
        return home.measured(recording)

    def at_once(self, spot: Spot) -> dict[str, Any]:
        """Go there, and try what comes of the trials elsewhere."""
        began = time.process_time()
        iteration = self._loop.move(spot.task)
        return self._tried(spot, iteration, time.process_time() - began)

    def again(self, spot: Spot) -> dict[str, Any]:
        """Learn from the trials so far, the last one there, and try it."""
        began = time.process_time()
        iteration = self._loop.propose()
        return self._tried(spot, iteration, time.process_time() - began)

    def _tried(self, spot: Spot, iteration: Iteration, seconds: float) -> dict[str, Any]:
        forecast = Forecast.of(spot.task, iteration, JOINTS)
        policy = PolicyOf(BAXTER_JOINTS, iteration.policy)
        rollout, measured = self._bench.run(spot, policy)
        self._loop.take(rollout)
        return {**measured, "predicted": forecast.total, "seconds": seconds}
