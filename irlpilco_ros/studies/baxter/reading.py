"""How the thesis may be read: config/thesis.yaml, and one of its settings changed at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from irlpilco_ros.studies.baxter.learning_run import folder_of, learning_job, thesis_settings
from irlpilco_ros.studies.job import Job, Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition, markdown, spread

EXPERIMENT = "reading"
ITERATIONS = 7
"""As many as the thesis says that it needed."""

BAR = 0.05
"""Joint error that a run is to come to [rad]."""

OTHERWISE: dict[str, dict[str, Any]] = {
    "as in the file": {},
    "L-BFGS of the gains themselves": {"optimiser": "lbfgs"},
    "first policy of random parameters": {"initial_policy": "random"},
    "of a tenth": {"initial_policy": "random", "initial_scale": 0.1},
    "of a hundredth": {"initial_policy": "random", "initial_scale": 0.01},
    "1.5 times the speed, at least 0.1 rad/s": {
        "velocity_limit_factor": 1.5,
        "velocity_limit_floor": 0.1,
    },
    "search from the last policy alone": {"starts": ("last",)},
    "search from zero alone": {"starts": ("zero",)},
    "starts spread by 0.03 rad": {"start_spread": 0.03},
}
"""Other readings, by what they say: all within what the thesis names.

Values are learning settings, and `start_spread` of the robot.
"""

DEPARTURES: dict[str, dict[str, Any]] = {
    "lambda 1": {"options": {"feature_matching.variance_weight": 1.0}},
    "velocity prior mean": {"prior_mean": "velocity"},
    "Gauss-Newton": {"optimiser": "gauss_newton"},
    "length-scales by dimension": {"hyperprior": "dimension_scaled"},
    "feed-forward": {"policy": "linear_phase"},
}
"""What the thesis does not have, by its name."""


def jobs(seeds: Sequence[int], iterations: int = ITERATIONS) -> list[Job]:
    """Return all jobs of the experiment, on the default robot."""
    changes = OTHERWISE | DEPARTURES
    return [_job(name, changes[name], seed, iterations) for seed in seeds for name in changes]


def _job(name: str, change: dict[str, Any], seed: int, iterations: int) -> Job:
    of_learning = {key: value for key, value in change.items() if key != "start_spread"}
    settings = thesis_settings()
    of_learning["options"] = {**settings.options, **change.get("options", {})}
    return learning_job(
        folder_of(EXPERIMENT, iterations, ITERATIONS),
        _condition(name),
        seed,
        settings=dataclasses.replace(settings, **of_learning),
        iterations=iterations,
        start_spread=change.get("start_spread", 0.0),
    )


def table(store: ResultStore, seeds: Sequence[int], iterations: int = ITERATIONS) -> str:
    """Return joint errors [mrad] over the iterations, and how many runs came to the bar.

    Beside them is what the model said of the last policy: how far off its mean would be, which
    is what the search sees, and the standard deviation, which it does not.
    """
    shown = [k for k in (0, 1, 3, 5, 7, 10, 15) if k < iterations] + [iterations]
    found = by_condition(store, jobs(seeds, iterations))
    rows = []
    for kind, changes in (("", OTHERWISE), ("beyond the thesis: ", DEPARTURES)):
        for name in changes:
            runs = found.get(_condition(name), [])
            cells = [spread([run["rows"][k]["rmse"] for run in runs], form=".0f") for k in shown]
            least = [_least(run) for run in runs]
            within = f"{sum(error <= BAR for error in least)} of {len(runs)}"
            predicted = [spread(each, form=".0f") for each in _predicted(runs)]
            rows.append([kind + name, *cells, spread(least, form=".0f"), within, *predicted])
    header = ["config/thesis.yaml", *[f"k = {k}" for k in shown], "least"]
    last = [f"predicted error, k = {iterations}", "predicted deviation"]
    return markdown([*header, f"came to {1e3 * BAR:.0f}", *last], rows)


def _least(run: Result) -> float:
    """Return the least joint error of the learned policies of a run [rad]."""
    return min(float(row["rmse"]) for row in run["rows"][1:])


def _predicted(runs: Sequence[Result]) -> tuple[list[float], list[float]]:
    """Return error of the predicted mean and predicted deviation of each run's last trial [rad]."""
    errors, deviations = [], []
    for run in runs:
        predicted, shown = run["rows"][-1]["predicted"], np.array(run["demonstration"])
        mean, deviation = (np.array(predicted[name])[1:] for name in ("mean", "deviation"))
        errors.append(float(np.sqrt(np.mean((mean - shown[1:, : mean.shape[1]]) ** 2))))
        deviations.append(float(np.sqrt(np.mean(deviation**2))))
    return errors, deviations


def _condition(name: str) -> str:
    return name.replace(",", "").replace("/", "_").replace(" ", "_")
