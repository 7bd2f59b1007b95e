"""A learning run's result as the report's figures want it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from irlpilco_ros.experience.path_quality import UNKNOWN, PathQuality
from irlpilco_ros.report.run_summary import IterationSummary, RunSummary
from irlpilco_ros.studies.baxter.learning_run import JOINTS, TRIAL_SECONDS
from irlpilco_ros.studies.job import Result
from sim_bridge.joints import ARM_JOINTS


def summary_of(name: str, result: Result) -> RunSummary:
    """Return the summary of a result of `learning_run`; robot time is without the replay."""
    shown = np.array(result["demonstration"])[:, :JOINTS]
    return RunSummary(
        name=name,
        joints=tuple(ARM_JOINTS),
        times=np.linspace(0.0, TRIAL_SECONDS, len(shown)),
        demonstration=shown,
        iterations=tuple(_iteration(index, row) for index, row in enumerate(result["rows"])),
        replay=np.array(result["replay_positions"]),
        replay_rmse=result["replay_rmse"],
        model=None,
        settings={},
        replay_path=_path(result.get("replay_path")),
        demonstration_path=_path(result.get("demonstration_path")),
    )


def _iteration(index: int, row: dict[str, Any]) -> IterationSummary:
    predicted = row["predicted"]
    return IterationSummary(
        index=index,
        trial=np.array(row["positions"]),
        prediction=None if predicted is None else np.array(predicted["mean"]),
        deviation=None if predicted is None else np.array(predicted["deviation"]),
        weights=None,
        rmse=row["rmse"],
        mse=row["mse"],
        margin=row["margin"],
        cost=math.nan if row["cost"] is None else row["cost"],
        robot_time=TRIAL_SECONDS * (index + 1),
        model_time=row["model_seconds"],
        policy_time=row["policy_seconds"],
        path=_path(row.get("path")),
    )


def _path(quality: dict[str, float] | None) -> PathQuality:
    """Return how a path was done; results from before it was measured do not tell."""
    return UNKNOWN if quality is None else PathQuality(**quality)
