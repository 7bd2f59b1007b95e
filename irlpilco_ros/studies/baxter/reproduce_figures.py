"""The thesis's figures of its Baxter chapter: 5.2, 5.3, 6.1, and those of appendix B."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.report import style
from irlpilco_ros.report.joint_figures import position_figure
from irlpilco_ros.report.run_summary import IterationSummary, RunSummary
from irlpilco_ros.studies.baxter import reproduce
from irlpilco_ros.studies.baxter.curves import median_and_range, over_iterations
from irlpilco_ros.studies.baxter.run_summary import summary_of
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition

SHOWN_ITERATIONS = (1, 7, 15)
SHOWN_JOINT = "left_w2"
_TITLES = {"thesis": "Baxter, thesis's settings", "default": "Baxter, defaults"}


def methods_figure(store: ResultStore, seeds: Sequence[int], cart_pole: Path) -> Figure | None:
    """Draw the error (6.1) of both methods over the iterations (thesis figure 6.1)."""
    found = by_condition(store, reproduce.jobs(seeds))
    if not found:
        return None
    panels = {
        title: {
            method: over_iterations(found[f"{settings}_{method}"], "mse")
            for method in reproduce.METHODS
            if f"{settings}_{method}" in found
        }
        for settings, title in _TITLES.items()
    }
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.9), layout="constrained")
        axes = figure.subplots(1, 3, squeeze=False)[0]
        axes[1].sharey(axes[0])
        for each, (title, errors) in zip(axes, panels.items(), strict=False):
            _errors(each, title, errors, "error (6.1) [rad²]")
        _errors(
            axes[2], "Cart-pole", cart_pole_errors(cart_pole), "error (6.1) of x [m], sin θ, cos θ"
        )
    return figure


def _errors(axes: Axes, title: str, errors: Mapping[str, Array], quantity: str) -> None:
    axes.set_title(title)
    axes.set_xlabel("iteration (0: initial trial)")
    axes.set_ylabel(quantity)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if not errors:
        axes.text(0.5, 0.5, "not measured", ha="center", transform=axes.transAxes)
        style.blank(axes)
        return
    for method, values in errors.items():
        label = f"{method.replace('_', ' ')}, {_count(len(values))}"
        places = np.arange(values.shape[1], dtype=float)
        median_and_range(axes, places, values, label, reproduce.METHODS.index(method))
    style.log_scale(axes)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.08), handlelength=4.0)


def _count(seeds: int) -> str:
    return f"{seeds} seed" + "s" * (seeds > 1)


def cart_pole_errors(folder: Path) -> dict[str, Array]:
    """Return the error (6.1) of every trial of `irlpilco cart-pole`, (seeds, iterations + 1).

    Returns:
        By method, for those seeds that have as many iterations as the longest; empty if there
        are no results.
    """
    path = folder / "results.json"
    if not path.is_file():
        return {}
    curves: dict[str, dict[int, list[float]]] = {}
    for row in json.loads(path.read_text(encoding="utf-8"))["rows"]:
        if row["method"] in reproduce.METHODS:
            seeds = curves.setdefault(row["method"], {})
            seeds.setdefault(row["seed"], []).append(row["error_6_1"])
    errors = {}
    for method in reproduce.METHODS:
        values = list(curves.get(method, {}).values())
        longest = max(map(len, values), default=0)
        if longest:
            errors[method] = np.array([each for each in values if len(each) == longest])
    return errors


def left_w2_figure(store: ResultStore, seeds: Sequence[int], settings: str) -> Figure | None:
    """Draw left_w2 in trials of both methods (thesis figures 5.2 and 5.3).

    Args:
        store: The study's results.
        seeds: The first one that has results is shown.
        settings: "thesis" or "default".
    """
    runs = _first_runs(store, seeds, settings)
    if not runs:
        return None
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 2.4 * len(runs) + 0.7), layout="constrained")
        grid = figure.subplots(
            len(runs), len(SHOWN_ITERATIONS), sharex=True, sharey=True, squeeze=False
        )
        for line, (method, run) in zip(grid, runs.items(), strict=True):
            for axes, wanted in zip(line, SHOWN_ITERATIONS, strict=True):
                iteration = run.iterations[min(wanted, len(run.iterations) - 1)]
                _joint(axes, run, iteration)
                axes.set_title(f"{method.replace('_', ' ')}, iteration {iteration.index}")
            line[0].set_ylabel(f"position of {style.pretty(SHOWN_JOINT)} [rad]")
        for axes in grid[-1]:
            axes.set_xlabel("time in the trial [s]")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


def _joint(axes: Axes, run: RunSummary, iteration: IterationSummary) -> None:
    joint = run.joints.index(SHOWN_JOINT)
    if iteration.prediction is not None and iteration.deviation is not None:
        mean, reach = iteration.prediction[:, joint], 2.0 * iteration.deviation[:, joint]
        band = style.BAND | {"label": "prediction, ± 2 standard deviations"}
        axes.fill_between(run.times, mean - reach, mean + reach, **band)
        axes.plot(run.times, mean, label="prediction, mean", **style.PREDICTION)
    axes.plot(run.times, run.demonstration[:, joint], label="demonstration", **style.DEMONSTRATION)
    if run.replay is not None:
        axes.plot(run.times, run.replay[:, joint], label="replay", **style.REPLAY)
    axes.plot(run.times, iteration.trial[:, joint], label="trial", **style.ROBOT)


def all_joints_figure(store: ResultStore, seeds: Sequence[int], settings: str) -> Figure | None:
    """Draw all joints in the last trial of feature matching (thesis, appendix B).

    Args:
        store: The study's results.
        seeds: The first one that has results is shown.
        settings: "thesis" or "default".
    """
    run = _first_runs(store, seeds, settings).get("feature_matching")
    return None if run is None else position_figure(run, run.last)


def _first_runs(store: ResultStore, seeds: Sequence[int], settings: str) -> dict[str, RunSummary]:
    """Return the first run of each method that there is."""
    found = by_condition(store, reproduce.jobs(seeds))
    names = {method: f"{settings}_{method}" for method in reproduce.METHODS}
    return {
        method: summary_of(name, found[name][0]) for method, name in names.items() if name in found
    }
