"""Hands, not only joints (thesis 6 and 7.2): imitation of where brush tip and pan lip are."""

from __future__ import annotations

from collections.abc import Sequence

from irlpilco_ros.studies.baxter import headline
from irlpilco_ros.studies.baxter.learning_run import learning_job
from irlpilco_ros.studies.job import Job

EXPERIMENT = "hands"


def hands_job(robot: str, seed: int) -> Job:
    """Return the job of imitating tool points; joint features are in the headline's results."""
    return learning_job(EXPERIMENT, robot, seed, robot, None, headline.ITERATIONS, "tools")


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs of the experiment."""
    robots = (headline.DEFAULT, headline.MISCALIBRATED)
    return [hands_job(robot, seed) for seed in seeds for robot in robots]
