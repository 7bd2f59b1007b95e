"""The chapter's figures, as SVG: readable in greyscale, every axis with its unit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from irlpilco_ros.report import style
from irlpilco_ros.report.svg import to_svg
from irlpilco_ros.studies.baxter import headline, reproduce
from irlpilco_ros.studies.job import Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition

LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.ORANGE, "linestyle": "-", "marker": "o"},
    {"color": style.BLUE, "linestyle": (0, (5, 2)), "marker": "s"},
    {"color": style.INK, "linestyle": (0, (1, 1.5)), "marker": "^"},
    {"color": style.FAINT, "linestyle": (0, (6, 2, 1, 2)), "marker": "D"},
)
TRIAL_SECONDS = 8.0


def write_figures(store: ResultStore, seeds: Sequence[int], folder: Path) -> list[Path]:
    """Draw what there are results for; returns the files."""
    makers: dict[str, Callable[[ResultStore, Sequence[int]], Figure | None]] = {
        "robot_time": robot_time_figure,
        "methods": methods_figure,
        "left_w2": joint_figure,
    }
    written = []
    for name, maker in makers.items():
        figure = maker(store, seeds)
        if figure is not None:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / f"{name}.svg"
            path.write_text(to_svg(figure), encoding="utf-8")
            written.append(path)
    return written


def robot_time_figure(store: ResultStore, seeds: Sequence[int]) -> Figure | None:
    """Draw joint error against robot time: median and range over seeds, and replay."""
    found = by_condition(store, headline.jobs(seeds))
    if not found:
        return None
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.8), layout="constrained")
        panels = figure.subplots(1, len(found), sharey=True, squeeze=False)[0]
        for axes, (condition, runs) in zip(panels, found.items(), strict=True):
            errors = _over_iterations(runs, "rmse")
            seconds = TRIAL_SECONDS * (1.0 + np.arange(errors.shape[1]))
            _median_and_range(axes, seconds, errors, f"learned, {len(runs)} seeds", 0)
            replay = float(np.median([run["replay_rmse"] for run in runs]))
            axes.axhline(replay, label="replay, median", **style.REPLAY)
            axes.set_title(condition.replace("_", " "))
            axes.set_xlabel("robot time [s]")
            axes.set_yscale("log")
            axes.legend(loc="upper right")
        panels[0].set_ylabel("joint error, RMS [rad]")
    return figure


def methods_figure(store: ResultStore, seeds: Sequence[int]) -> Figure | None:
    """Draw the error (6.1) of both methods over the iterations (thesis figure 6.1)."""
    found = by_condition(store, reproduce.jobs(seeds))
    if not found:
        return None
    with style.look():
        figure = Figure(figsize=(0.72 * style.PAGE_WIDTH, 3.8), layout="constrained")
        axes = figure.subplots()
        for number, (condition, runs) in enumerate(found.items()):
            errors = _over_iterations(runs, "mse")
            places = np.arange(errors.shape[1], dtype=float)
            label = f"{condition.replace('_', ' ')}, n = {len(runs)}"
            _median_and_range(axes, places, errors, label, number)
        axes.set_yscale("log")
        axes.set_xlabel("iteration (0: initial trial)")
        axes.set_ylabel("error (6.1) [rad²]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def joint_figure(store: ResultStore, seeds: Sequence[int]) -> Figure | None:
    """Draw left_w2 by both methods at their last iteration (thesis figures 5.2 and 5.3)."""
    found = by_condition(store, reproduce.jobs(seeds[:1]))
    if not found:
        return None
    joint = 6
    with style.look():
        figure = Figure(figsize=(0.72 * style.PAGE_WIDTH, 3.8), layout="constrained")
        axes = figure.subplots()
        shown = np.array(next(iter(found.values()))[0]["demonstration"])[:, joint]
        times = np.linspace(0.0, TRIAL_SECONDS, len(shown))
        axes.plot(times, shown, label="demonstration", **style.DEMONSTRATION)
        for number, (condition, runs) in enumerate(found.items()):
            rows = runs[0]["rows"]
            line = np.array(rows[-1]["positions"])[:, joint]
            label = f"{condition.replace('_', ' ')}, iteration {len(rows) - 1}"
            axes.plot(times, line, label=label, markersize=3.5, **LOOKS[number])
        axes.set_xlabel("time in the trial [s]")
        axes.set_ylabel("position of left w2 [rad]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _over_iterations(runs: Sequence[Result], key: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return a number of every row of every run, shape (seeds, iterations + 1)."""
    return np.array([[row[key] for row in run["rows"]] for run in runs])


def _median_and_range(
    axes: Axes,
    places: np.ndarray[Any, np.dtype[np.float64]],
    values: np.ndarray[Any, np.dtype[np.float64]],
    label: str,
    number: int,
) -> None:
    look = LOOKS[number]
    axes.fill_between(
        places, values.min(axis=0), values.max(axis=0), color=look["color"], alpha=0.18, linewidth=0
    )
    axes.plot(places, np.median(values, axis=0), label=label, markersize=4.5, **look)
