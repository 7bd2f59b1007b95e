"""Robot time: how well the sweep is done after each iteration, and replay beside it."""

from __future__ import annotations

from collections.abc import Sequence

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.studies.baxter.learning_run import learning_job
from irlpilco_ros.studies.job import Job

EXPERIMENT = "headline"
ITERATIONS = 7

DEFAULT, MISCALIBRATED, RANDOM = "default", "miscalibrated", "random_first_policy"


def headline_job(condition: str, seed: int, iterations: int = ITERATIONS) -> Job:
    """Return the job of one condition; `RANDOM` begins with the thesis's first policy."""
    robot = "miscalibrated" if condition == MISCALIBRATED else "default"
    first = "random" if condition == RANDOM else "demonstration"
    settings = LearningSettings(initial_policy=first)
    return learning_job(EXPERIMENT, condition, seed, robot, settings, iterations)


def jobs(seeds: Sequence[int], iterations: int = ITERATIONS) -> list[Job]:
    """Return all jobs of the experiment."""
    return [
        headline_job(condition, seed, iterations)
        for seed in seeds
        for condition in (MISCALIBRATED, DEFAULT, RANDOM)
    ]
