"""The tables of the report: their headings, and a row for each trial or joint."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from irlpilco_ros.experience.path_quality import PathQuality
from irlpilco_ros.report import style
from irlpilco_ros.report.joint_use import JointUse
from irlpilco_ros.report.run_summary import IterationSummary, RunSummary


@dataclass(frozen=True)
class TableRow:
    """A row; `kind` is its class in the style sheet."""

    kind: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table that fits a page, and scrolls sideways on a phone."""

    headings: tuple[str, ...]
    rows: tuple[TableRow, ...]


def error_table(run: RunSummary) -> Table:
    """Return how far off each trial was, beside replay."""
    headings = [
        "iteration",
        "at the decisions, RMS",
        "within its band [%]",
        "robot time [s]",
    ]
    if run.path_is_known:
        headings[1:1] = ["whole path, RMS", "whole path, largest"]
    rows = [TableRow(_kind(run, each), _error_cells(run, each)) for each in run.iterations]
    if math.isfinite(run.replay_rmse):
        path = (run.replay_path.rmse, run.replay_path.largest) if run.path_is_known else ()
        numbers = tuple(number(value, ".4f") for value in (*path, run.replay_rmse))
        rows.append(TableRow("replay", ("open-loop replay", *numbers, "-", "-")))
    return Table(tuple(headings), tuple(rows))


def acceleration_table(run: RunSummary) -> Table | None:
    """Return how hard each motion was; None where that was not recorded."""
    paths = [(_name(run, each), _kind(run, each), each.path) for each in run.iterations]
    paths += [("open-loop replay", "replay", run.replay_path)]
    paths += [("demonstration", "replay", run.demonstration_path)]
    known = [each for each in paths if math.isfinite(each[2].acceleration_max)]
    unit = _per_time(run.unit, "s²")
    headings = ("iteration", f"99 % of the time below [{unit}]", f"largest [{unit}]")
    rows = tuple(TableRow(kind, (name, *_accelerations(path))) for name, kind, path in known)
    return Table(headings, rows) if rows else None


def learning_table(run: RunSummary) -> Table:
    """Return what each iteration was computed with, and how long that took."""
    headings = ("iteration", "error (6.1)", "margin", "cost", "model [s]", "policy [s]")
    rows = tuple(
        TableRow(_kind(run, each), (_name(run, each), *_learning_cells(each)))
        for each in run.iterations
    )
    return Table(headings, rows)


def use_table(run: RunSummary) -> Table | None:
    """Return what each joint used of its limits in the best trial; None where nobody knows."""
    if not run.uses:
        return None
    is_effort = run.commands == "efforts"
    if run.is_mixed:
        headings = ["joint", "went", "may go", "largest speed, per s", "shown", "limit"]
    else:
        headings = ["joint", f"went [{run.unit}]", f"may go [{run.unit}]"]
        headings += [f"largest speed [{_per_time(run.unit, 's')}]", "shown", "limit"]
    headings += ["largest effort", "limit"] if is_effort else ["largest command"]
    rows = [_use_row(use, run.beside(j), is_effort) for j, use in enumerate(run.uses)]
    return Table(tuple(headings), tuple(rows))


def use_sentence(run: RunSummary) -> str:
    """Say which joint came nearest to its limits in the best trial; "" where nobody knows."""
    if not run.uses:
        return ""
    fast = max(run.uses, key=lambda each: each.speed_share if each.speed_share > 0.0 else 0.0)
    near = min(run.uses, key=lambda each: each.room)
    return (
        f"Fastest for its limit: {style.pretty(fast.joint)}, {_percent(fast.speed_share)} of "
        f"{fast.speed_limit:g}\u00a0{_per_time(_unit(run, fast), 's')}. Nearest to an end of its "
        f"range: {style.pretty(near.joint)}, {near.room:.2f}\u00a0{_unit(run, near)} before it."
    )


def number(value: float, form: str) -> str:
    """Return a number as it is printed, or a dash where nobody knows it."""
    return format(value, form) if math.isfinite(value) else "-"


def _use_row(use: JointUse, unit: str, is_effort: bool) -> TableRow:
    command = [number(use.command, ".3g")]
    if is_effort:
        known = math.isfinite(use.command)
        command.append(number(use.command_limit if known else math.nan, "g"))
    speeds = (number(use.speed, ".2f"), number(use.shown_speed, ".2f"), f"{use.speed_limit:g}")
    ranges = (_range(use.reached), _range(use.limits))
    return TableRow("", (f"{style.pretty(use.joint)}{unit}", *ranges, *speeds, *command))


def _unit(run: RunSummary, use: JointUse) -> str:
    return run.unit_of(run.uses.index(use))


def _per_time(unit: str, time: str) -> str:
    """Return a unit per [s] or [s²]: "rad or m" gives "rad/s or m/s"."""
    return " ".join(f"{word}/{time}" if word in ("rad", "m") else word for word in unit.split())


def _range(ends: tuple[float, float]) -> str:
    return " … ".join(f"{end:.2f}" for end in ends).replace("-", "\u2212")


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f}\u00a0%" if math.isfinite(share) else "an unknown part"


def _kind(run: RunSummary, iteration: IterationSummary) -> str:
    return "best" if iteration is run.best else ""


def _name(run: RunSummary, iteration: IterationSummary) -> str:
    name = str(iteration.index) if iteration.index > 0 else "0, initial trial"
    return f"{name}, best" if iteration is run.best else name


def _error_cells(run: RunSummary, iteration: IterationSummary) -> tuple[str, ...]:
    cells = [_name(run, iteration)]
    if run.path_is_known:
        path = iteration.path
        cells += [number(path.rmse, ".4f"), number(path.largest, ".4f")]
    within = number(100.0 * run.coverage(iteration), ".0f")
    return (*cells, f"{iteration.rmse:.4f}", within, f"{round(iteration.robot_time, 1):g}")


def _accelerations(path: PathQuality) -> Iterator[str]:
    yield number(path.acceleration_p99, ".2f")
    yield number(path.acceleration_max, ".1f")


def _learning_cells(iteration: IterationSummary) -> tuple[str, ...]:
    learned = iteration.index > 0
    return (
        number(iteration.mse, ".2e"),
        number(iteration.margin, ".2e"),
        number(iteration.cost, ".4g"),
        number(iteration.model_time if learned else math.nan, ".1f"),
        number(iteration.policy_time if learned else math.nan, ".1f"),
    )
