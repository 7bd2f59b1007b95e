"""How a run went from iteration to iteration: error, weights, margin, time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from irlpilco_ros.report import style
from irlpilco_ros.report.run_summary import RunSummary

WIDE = 8.0
"""Largest by smallest value from which on an axis is logarithmic."""


def error_figure(run: RunSummary) -> Figure:
    """Draw the joint error of every trial, beside replay and what the model expected."""
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH * 0.72, 3.6), layout="constrained")
        axes = figure.subplots()
        indices = [i.index for i in run.iterations]
        errors = [i.rmse for i in run.iterations]
        robot = {**style.ROBOT, "linewidth": 1.8, "markersize": 6.0}
        paths = [i.path.rmse for i in run.iterations]
        if run.path_is_known:
            axes.plot(indices, paths, label="robot, whole path", zorder=4, **robot)
            robot |= {"linewidth": 1.1, "linestyle": ":", "markersize": 4.0}
        axes.plot(indices, errors, label="robot, at the decisions", zorder=3, **robot)
        expected = [run.predicted_rmse(i) for i in run.iterations]
        if np.isfinite(expected).any():
            diamonds = {**style.PREDICTION, "marker": "D", "markersize": 5.0}
            label = "expected by the model before the trial"
            axes.plot(indices, expected, label=label, markerfacecolor="white", **diamonds)
        if np.isfinite(run.replay_rmse):
            label = f"open-loop replay: {run.replay_rmse:.4f} {run.unit}"
            axes.axhline(run.replay_rmse, label=label, **style.REPLAY)
        axes.set_ylabel(f"error, RMS [{run.unit}]")
        _wide_scale(axes, [*errors, *expected, *paths, run.replay_rmse])
        _iteration_axis(axes, run)
        _robot_time_axis(axes, run)
        figure.legend(loc="outside lower center", ncols=3)
        return figure


def weights_figure(run: RunSummary) -> Figure:
    """Draw the cost weight of every feature over the iterations, and the margin."""
    with style.look():
        height = 0.24 * len(run.feature_names) + 1.0
        figure = Figure(figsize=(style.PAGE_WIDTH, max(height, 3.0)), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        if any(i.weights is not None for i in run.iterations):
            _weight_map(left, run)
        else:
            style.blank(left)
        finite = [i for i in run.iterations if np.isfinite(i.margin) and i.margin > 0.0]
        line = {**style.ROBOT, "color": style.INK, "linewidth": 1.5, "markersize": 5.0}
        right.plot([i.index for i in finite], [i.margin for i in finite], **line)
        unit = f" [{run.margin_unit}]" if run.margin_unit else ""
        right.set_ylabel(f"margin of the weights{unit}")
        _wide_scale(right, [i.margin for i in finite])
        _iteration_axis(right, run)
        right.set_title("margin")
        return figure


def time_figure(run: RunSummary) -> Figure:
    """Draw the computing time of every iteration and the robot time used so far [s]."""
    learned = [i for i in run.iterations if i.index > 0]
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 2.9), layout="constrained")
        left, right = figure.subplots(1, 2)
        places = [i.index for i in learned]
        model = np.array([i.model_time for i in learned])
        policy = np.array([i.policy_time for i in learned])
        left.bar(places, model, 0.62, color="#9ecae1", edgecolor=style.INK, label="dynamics model")
        policy_look = {"color": style.BLUE, "edgecolor": style.INK, "label": "policy search"}
        left.bar(places, policy, 0.62, bottom=model, **policy_look)
        left.set_ylim(0.0, 1.28 * max(float((model + policy).max(initial=0.0)), 0.1))
        left.set_ylabel("computing time [s]")
        left.set_title(f"computing, {run.computing_time:.3g} s in all")
        left.legend(loc="upper left", ncols=2)
        left.grid(False, axis="x")
        steps = [i.robot_time for i in run.iterations]
        line = {**style.ROBOT, "linewidth": 1.5, "markersize": 5.0}
        right.plot([i.index for i in run.iterations], steps, **line)
        right.set_ylim(bottom=0.0)
        right.set_ylabel("robot time used so far [s]")
        right.set_title(f"robot, {round(run.last.robot_time, 1):g} s in all")
        for axes in (left, right):
            _iteration_axis(axes, run)
        return figure


def _weight_map(axes: Axes, run: RunSummary) -> None:
    weighted = [(i.index, i.weights) for i in run.iterations if i.weights is not None]
    values = np.column_stack([weights for _, weights in weighted])
    axes.imshow(values, cmap=style.SEQUENTIAL, vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        colour = "white" if value > 0.55 else style.INK
        text = f"{value:.2f}" if value >= 0.005 else "0"
        axes.text(column, row, text, ha="center", va="center", fontsize=7.0, color=colour)
    names = [style.pretty(name) for name in run.feature_names]
    axes.set_yticks(range(len(names)), names)
    axes.set_xticks(range(len(weighted)), [str(index) for index, _ in weighted])
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    axes.set_xlabel("iteration")
    axes.set_title("cost weights, length of the vector 1")


def _iteration_axis(axes: Axes, run: RunSummary) -> None:
    axes.set_xlabel("iteration (0: initial trial)")
    axes.set_xlim(-0.5, run.last.index + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(15, integer=True))


def _robot_time_axis(axes: Axes, run: RunSummary) -> None:
    """Say on top how much robot time each trial had cost."""
    top = axes.secondary_xaxis("top")
    shown = run.iterations[:: max(1, len(run.iterations) // 10)]
    top.set_xticks([i.index for i in shown], [f"{round(i.robot_time, 1):g}" for i in shown])
    top.set_xlabel("robot time used so far [s]", color=style.FAINT)
    top.tick_params(labelcolor=style.FAINT)
    top.spines[:].set_visible(False)


def _wide_scale(axes: Axes, values: list[float]) -> None:
    """Begin the y axis at zero or, if the values differ by a factor, make it logarithmic."""
    finite = [value for value in values if np.isfinite(value) and value > 0.0]
    if not finite or max(finite) < WIDE * min(finite):
        axes.set_ylim(bottom=0.0)
        return
    style.log_scale(axes)
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
