"""The chapter's figures, as SVG: readable in greyscale, every axis with its unit."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from irlpilco_ros.report import style
from irlpilco_ros.report.svg import to_svg
from irlpilco_ros.studies.baxter import headline, motion_bench, places, reproduce
from irlpilco_ros.studies.baxter.curves import median_and_range, over_iterations
from irlpilco_ros.studies.baxter.learning_run import TRIAL_SECONDS
from irlpilco_ros.studies.baxter.motion_figure import motion_figure
from irlpilco_ros.studies.baxter.places_figure import places_figure
from irlpilco_ros.studies.baxter.reproduce_figures import (
    all_joints_figure,
    left_w2_figure,
    methods_figure,
)
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition


def write_figures(
    store: ResultStore,
    seeds: Sequence[int],
    folder: Path,
    cart_pole: Path,
    experiments: Collection[str],
) -> list[Path]:
    """Draw what there are results for; returns the files.

    Args:
        store: The study's results.
        seeds: Those that count.
        folder: Where the figures go.
        cart_pole: Folder of the cart-pole chapter, whose curves stand beside the Baxter's; may be
            missing.
        experiments: Only figures of these are drawn.
    """
    makers: dict[str, tuple[str, Callable[[], Figure | None]]] = {
        "robot_time": (headline.EXPERIMENT, partial(robot_time_figure, store, seeds)),
        "motion": (motion_bench.EXPERIMENT, partial(motion_figure, store, seeds)),
        "places": (places.EXPERIMENT, partial(places_figure, store, seeds)),
        "methods": (reproduce.EXPERIMENT, partial(methods_figure, store, seeds, cart_pole)),
    }
    for settings in ("thesis", "default"):
        for name, figure_of in (("left_w2", left_w2_figure), ("joints", all_joints_figure)):
            makers[f"{name}_{settings}"] = (
                reproduce.EXPERIMENT,
                partial(figure_of, store, seeds, settings),
            )
    written = []
    for name, (experiment, maker) in makers.items():
        figure = maker() if experiment in experiments else None
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
            errors = over_iterations(runs, "rmse")
            seconds = TRIAL_SECONDS * np.arange(1, errors.shape[1] + 1, dtype=np.float64)
            median_and_range(axes, seconds, errors, f"learned, {len(runs)} seeds", 0)
            replay = float(np.median([run["replay_rmse"] for run in runs]))
            axes.axhline(replay, label="replay, median", **style.REPLAY)
            axes.set_title(condition.replace("_", " "))
            axes.set_xlabel("robot time [s]")
            style.log_scale(axes)
            axes.legend(loc="upper right")
        panels[0].set_ylabel("joint error, RMS [rad]")
    return figure
