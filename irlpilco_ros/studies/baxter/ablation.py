"""What each choice is worth: one setting changed at a time, all others at their defaults."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.studies.baxter.learning_run import learning_job
from irlpilco_ros.studies.job import Job

EXPERIMENT = "ablation"
ITERATIONS = 5
CHANGES: dict[str, dict[str, Any]] = {
    "defaults": {},
    "zero prior mean": {"prior_mean": "zero"},
    "lambda 0": {"options": {"feature_matching.variance_weight": 0.0}},
    "no phase": {"policy": "linear"},
    "first policy zero": {"initial_policy": "zero"},
    "first policy random": {"initial_policy": "random"},
    "start from the last policy only": {"starts": ("last",)},
    "L-BFGS": {"optimiser": "lbfgs"},
    "L-BFGS, 80 evaluations": {"optimiser": "lbfgs", "evaluations": 80},
    "exact covariance": {"covariance_approximation": "exact"},
    "weights of the latest trial": {"weight_rule": "latest"},
    "projection weights": {"weight_rule": "projection"},
    "uniform weights": {"weight_rule": "uniform"},
    "no weight floor": {"weight_floor": 0.0},
    "velocity limit 1.5": {"velocity_limit_factor": 1.5},
    "velocity limit 2": {"velocity_limit_factor": 2.0},
    "40 evaluations": {"evaluations": 40},
}
"""Settings of each variant, by its name."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs, on the robot where learning matters: the miscalibrated one."""
    return [
        learning_job(
            EXPERIMENT,
            name.replace(",", "").replace(" ", "_"),
            seed,
            "miscalibrated",
            dataclasses.replace(LearningSettings(), **change),
            ITERATIONS,
        )
        for seed in seeds
        for name, change in CHANGES.items()
    ]
