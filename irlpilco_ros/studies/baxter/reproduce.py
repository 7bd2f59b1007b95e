"""The thesis's chapter 5 on Baxter: feature matching against feature expectations."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.studies.baxter.learning_run import folder_of, learning_job, thesis_settings
from irlpilco_ros.studies.job import Job

EXPERIMENT = "reproduce"
ITERATIONS = 15
METHODS = ("feature_matching", "feature_expectations")
THESIS_HOURS = {"feature_matching": 30, "feature_expectations": 15}
"""Computing of 15 iterations that the thesis reports [h]."""


def thesis_job(method: str, seed: int, iterations: int = ITERATIONS) -> Job:
    """Return the job of learning with the settings of config/thesis.yaml."""
    settings = dataclasses.replace(thesis_settings(), imitation=method)
    return _job(f"thesis_{method}", seed, settings, iterations)


def default_job(method: str, seed: int, iterations: int = ITERATIONS) -> Job:
    """Return the job of learning with the default settings."""
    settings = LearningSettings(imitation=method)
    return _job(f"default_{method}", seed, settings, iterations)


def jobs(seeds: Sequence[int], iterations: int = ITERATIONS) -> list[Job]:
    """Return all jobs of the experiment."""
    return [
        job(method, seed, iterations)
        for seed in seeds
        for job in (thesis_job, default_job)
        for method in METHODS
    ]


def _job(condition: str, seed: int, settings: LearningSettings, iterations: int) -> Job:
    """Return the job on the default robot; another number of iterations replaces no results."""
    folder = folder_of(EXPERIMENT, iterations, ITERATIONS)
    return learning_job(folder, condition, seed, "default", settings, iterations)
