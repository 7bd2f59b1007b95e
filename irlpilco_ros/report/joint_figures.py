"""Every joint of one trial, side by side: demonstration, prediction, robot (thesis, appendix B)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from irlpilco_ros.report import style
from irlpilco_ros.report.run_summary import UNKNOWN_UNIT, FloatArray, IterationSummary, RunSummary

COLUMNS = 4
ROW_HEIGHT = 1.75
SMALLEST_SPAN = {"rad": 0.2, "m": 0.02, UNKNOWN_UNIT: 0.2}
"""Smallest range of a position axis, by its unit, so that a joint at rest looks at rest."""

_ARM = 3
"""Of fewer joints than that there is no arm: hip_pitch and knee_pitch are one leg."""


def joint_groups(joints: tuple[str, ...]) -> list[list[int]]:
    """Return the joints' indices arm by arm, as far as their names tell.

    Arms of one kind have joints of the same names but for what stands before the first "_", as
    left_s0 and right_s0, and at least three of them. All others are one group.
    """
    begins = [name.partition("_")[0] for name in joints]
    arms: dict[str, set[str]] = {}
    for begin, name in zip(begins, joints, strict=True):
        arms.setdefault(begin, set()).add(name.partition("_")[2])
    kinds = list(arms.values())
    groups: dict[str, list[int]] = {}
    for index, begin in enumerate(begins):
        is_arm = len(arms[begin]) >= _ARM and kinds.count(arms[begin]) > 1
        groups.setdefault(begin if is_arm else "", []).append(index)
    return list(groups.values())


def position_figure(run: RunSummary, iteration: IterationSummary) -> Figure:
    """Draw the position [rad] of every joint over the trial."""
    with style.look():
        figure, panels, free = _panels(run, iteration)
        for joint, axes in panels.items():
            _curves(axes, run, iteration, joint, lambda positions: positions)
            _at_least(axes, SMALLEST_SPAN[run.unit_of(joint)])
            axes.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
        _label(figure, "joint position", run)
        _legend(free[0], iteration)
        return figure


def difference_figure(run: RunSummary, iteration: IterationSummary) -> Figure:
    """Draw how far every joint is from the demonstration [rad], on one scale for all joints."""
    with style.look():
        figure, panels, free = _panels(run, iteration)
        limit = _common_limit(run, iteration)
        for joint, axes in panels.items():
            _curves(axes, run, iteration, joint, run.difference)
            axes.set_ylim(-limit, limit)
            axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        _label(figure, "difference from the demonstration", run)
        _legend(free[0], iteration)
        return figure


def _panels(
    run: RunSummary, iteration: IterationSummary
) -> tuple[Figure, dict[int, Axes], list[Axes]]:
    """Return a figure, the panel of every joint, and the empty panels, at least one."""
    groups = joint_groups(run.joints)
    if sum(-len(group) % COLUMNS for group in groups) == 0:
        groups.append([])
    places = [_fill(group) for group in groups]
    cells = [cell for place in places for cell in place]
    rows = len(cells) // COLUMNS
    width, height = style.PAGE_WIDTH, ROW_HEIGHT * rows + 0.4
    figure = Figure(figsize=(width, height))
    # Margins by hand [in]: a layout engine would draw every figure twice.
    edges = {"left": 0.75 / width, "right": 1.0 - 0.12 / width}
    edges |= {"bottom": 0.55 / height, "top": 1.0 - 0.25 / height}
    grid = figure.subplots(
        rows, COLUMNS, squeeze=False, gridspec_kw={"wspace": 0.27, "hspace": 0.42, **edges}
    )
    errors = run.joint_rmse(iteration)
    panels: dict[int, Axes] = {}
    free: list[Axes] = []
    for axes, cell in zip(grid.flat, cells, strict=True):
        if cell is None:
            style.blank(axes)
            free.append(axes)
            continue
        panels[cell] = axes
        axes.set_title(f"{style.pretty(run.joints[cell])}{run.beside(cell)}")
        axes.set_title(f"{errors[cell]:.4f}", loc="right", fontsize=8.0, color=style.FAINT)
        axes.set_xlim(run.times[0], run.times[-1])
        axes.xaxis.set_major_locator(MaxNLocator(2, integer=True, steps=[1, 2, 4, 5, 10]))
    return figure, panels, free


def _fill(group: list[int]) -> list[int | None]:
    missing = COLUMNS if not group else -len(group) % COLUMNS
    return [*group, *[None] * missing]


def _curves(
    axes: Axes,
    run: RunSummary,
    iteration: IterationSummary,
    joint: int,
    shown: Callable[[FloatArray], FloatArray],
) -> None:
    """Draw one joint's column of what is `shown` of positions (H+1, J)."""
    times = run.times
    axes.plot(times, shown(run.demonstration)[:, joint], **style.DEMONSTRATION)
    if iteration.prediction is not None and iteration.deviation is not None:
        mean = shown(iteration.prediction)[:, joint]
        spread = 2.0 * iteration.deviation[:, joint]
        axes.fill_between(times, mean - spread, mean + spread, **style.BAND)
        axes.plot(times, mean, **style.PREDICTION)
    axes.plot(times, shown(iteration.trial)[:, joint], **style.ROBOT)


def _common_limit(run: RunSummary, iteration: IterationSummary) -> float:
    """Return the half-range that shows every trial and band, 10 mrad at least [rad]."""
    largest = float(np.abs(run.difference(iteration.trial)).max())
    if iteration.prediction is not None and iteration.deviation is not None:
        band = np.abs(run.difference(iteration.prediction)) + 2.0 * iteration.deviation
        largest = max(largest, float(band.max()))
    return max(1.08 * largest, 0.01)


def _at_least(axes: Axes, span: float) -> None:
    low, high = axes.get_ylim()
    if high - low < span:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * span, middle + 0.5 * span)


def _label(figure: Figure, quantity: str, run: RunSummary) -> None:
    figure.supxlabel("time in the trial [s]", fontsize=9.0, y=0.008, va="bottom")
    if figure.get_figheight() < 2.0 * ROW_HEIGHT:  # one row of panels is no higher than this
        quantity = quantity.replace(" from the demonstration", "")
    if not run.is_mixed:
        quantity += f" [{run.unit}]"
    figure.supylabel(quantity, fontsize=9.0, x=0.004)


def _legend(axes: Axes, iteration: IterationSummary) -> None:
    handles: list[Line2D | Patch] = [Line2D([], [], label="demonstration", **style.DEMONSTRATION)]
    if iteration.prediction is not None:
        handles.append(Line2D([], [], label="prediction, mean", **style.PREDICTION))
        handles.append(Patch(label="prediction, ± 2 standard\ndeviations", **style.BAND))
    handles.append(Line2D([], [], label=f"robot, trial {iteration.index}", **style.ROBOT))
    axes.legend(handles=handles, loc="center left", bbox_to_anchor=(-0.02, 0.5), handlelength=2.6)
