"""The figure of the path's error over the trials: learned, and by iterative learning control."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from irlpilco_ros.report import style
from irlpilco_ros.studies.baxter import motion
from irlpilco_ros.studies.baxter.curves import median_and_range, over_iterations
from irlpilco_ros.studies.baxter.iterative_control import WAYS, best_iterative
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition

_LABELS = {"alone": "iterative control", "with_pd": "iterative control and PD"}


def motion_figure(store: ResultStore, seeds: Sequence[int]) -> Figure | None:
    """Draw the error of the path over the trials of every robot: median and range over seeds."""
    found = by_condition(store, motion.jobs(seeds))
    robots = [robot for robot in ROBOTS if robot in found]
    if not robots:
        return None
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 3.8), layout="constrained")
        panels = figure.subplots(1, len(robots), sharey=True, squeeze=False)[0]
        for axes, robot in zip(panels, robots, strict=True):
            learned = over_iterations(found[robot], "path")
            curves = {f"learned, {len(learned)} seeds": learned}
            for way in WAYS if f"iterative_{robot}" in found else ():
                curves[_LABELS[way]] = best_iterative(found[f"iterative_{robot}"], way)
            for number, (label, errors) in enumerate(curves.items()):
                trials = np.arange(errors.shape[1], dtype=np.float64)
                median_and_range(axes, trials, errors, label, number)
            axes.set_title(robot.replace("_", " and "))
            axes.set_xlabel("iteration k")
            style.log_scale(axes)
            axes.legend(loc="upper right")
        panels[0].set_ylabel("error of the path, RMS [rad]")
    return figure
