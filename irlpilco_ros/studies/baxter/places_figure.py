"""The figure of the error at a place never visited, over the places that were practised."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from irlpilco_ros.report import style
from irlpilco_ros.studies.baxter import places
from irlpilco_ros.studies.baxter.curves import median_and_range
from irlpilco_ros.studies.baxter.places_tables import (
    AFTER_ONE,
    BASELINES,
    baseline_trials,
    learned_trials,
    practised_errors,
)
from irlpilco_ros.studies.job import Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition

_LOOKS: dict[str, dict[str, Any]] = {
    "replay": style.REPLAY,
    "tracking": {"color": style.FAINT, "linestyle": (0, (1, 2)), "linewidth": 1.5},
    "iterative_alone": {"color": style.BLUE, "linestyle": (0, (5, 2)), "linewidth": 1.5},
    "iterative_with_pd": {"color": style.BLUE, "linestyle": (0, (1, 1.5)), "linewidth": 1.5},
    "primitive": {"color": style.INK, "linestyle": (0, (3, 1, 1, 1, 1, 1)), "linewidth": 1.2},
}

_TICKS = (1, 2, 3, 5, 10, 20, 30, 50, 100)


def places_figure(store: ResultStore, seeds: Sequence[int]) -> Figure | None:
    """Draw the error at once over the number of places practised, and the baselines' medians."""
    found = by_condition(store, places.jobs(seeds))
    robots = [robot for robot in places.PLACES_ROBOTS if found.get(robot)]
    if not robots:
        return None
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.8), layout="constrained")
        panels = figure.subplots(1, len(robots), sharey=True, squeeze=False)[0]
        for axes, robot in zip(panels, robots, strict=True):
            _baselines(axes, found.get(f"carried_{robot}", []))
            _learned(axes, found[robot])
            axes.set_title(f"{robot}, {len(found[robot])} seeds")
            axes.set_xlabel("places practised, one trial each")
            axes.set_yscale("log")
            axes.set_yticks(_TICKS, labels=map(str, _TICKS))
            axes.minorticks_off()
        panels[0].set_ylabel("error of the path where no trial was, RMS [mrad]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside right center")
    return figure


def _baselines(axes: Axes, runs: Sequence[Result]) -> None:
    for name, trials in baseline_trials(runs).items():
        median = float(np.median([np.inf if each is None else each["path"] for each in trials]))
        axes.axhline(1e3 * median, label=BASELINES[name], **_LOOKS[name])


def _learned(axes: Axes, runs: Sequence[Result]) -> None:
    errors = 1e3 * np.array(practised_errors(runs)).T
    counts = np.arange(errors.shape[1], dtype=np.float64)
    median_and_range(axes, counts, errors, "learned, at once", 0)
    after = [1e3 * trial["path"] for trial in learned_trials(runs)[AFTER_ONE]]
    label = "learned, after one trial there"
    axes.axhline(float(np.median(after)), label=label, color=style.ORANGE, linewidth=0.8)
