"""Tables of the motion that the arm makes: its path, how hard it is, and what holds of the bars."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.studies.baxter import motion
from irlpilco_ros.studies.baxter.iterative_control import WAYS, best_iterative
from irlpilco_ros.studies.baxter.motion_bench import ITERATIONS, PERIOD
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.job import Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition, markdown, spread
from sim_bridge.tool_kinematics import TOOL_POINTS

SLACK = 1.5
"""Nine of ten seeds shall be within so many times a bar, and the median within it."""

_SHARE = 0.9
_BAND = (90.0, 98.0)  # [%] of a trial that a predicted band of two deviations shall hold
_BAND_FROM = 2  # the first iteration of which it shall
_COLUMNS = (0, 1, 2, 3, 5, 7)
_WAY_NAMES = {"alone": "iterative control", "with_pd": "iterative control and PD"}
_PAN_LIP, _BRUSH_TIP = (TOOL_POINTS.index(name) for name in ("dustpan_lip", "brush_tip"))

Measure = Callable[[Result, dict[str, Any]], float]
"""A number of a run's row, in the unit of its table."""


def _thousandths(key: str) -> Measure:
    return lambda _run, row: 1e3 * row[key]


def _tool(number: int) -> Measure:
    return lambda _run, row: 1e3 * row["tools"][number]


def _hardness(run: Result, row: dict[str, Any]) -> float:
    return float(row["acceleration_p99"] / run["demonstration"]["acceleration_p99"])


@dataclass(frozen=True)
class Bar:
    """What a robot's motion is held against.

    Attributes:
        robot: A key of `ROBOTS`.
        iteration: Of the policy whose trial counts.
        what: Name and unit of what is measured.
        limit: It shall be at most that.
        measure: How it is found.
    """

    robot: str
    iteration: int
    what: str
    limit: float
    measure: Measure


def _largest_acceleration(_run: Result, row: dict[str, Any]) -> float:
    return float(row["acceleration_max"])


_PATH, _TICKS = ("path [mrad]", _thousandths("path")), ("ticks [mrad]", _thousandths("ticks"))
_HARDEST = ("largest acceleration [rad/s²]", _largest_acceleration)


def _bar(robot: str, iteration: int, limit: float, what: tuple[str, Measure] = _PATH) -> Bar:
    return Bar(robot, iteration, what[0], limit, what[1])


BARS = (
    _bar("default", 3, 1.6),
    _bar("default", 7, 1.2),
    _bar("default", 3, 1.5, ("acceleration p99, times the demonstration's", _hardness)),
    _bar("default", 3, 5.0, _HARDEST),
    _bar("default", 5, 2.5, ("brush tip, path [mm]", _tool(_BRUSH_TIP))),
    _bar("default", 5, 2.5, ("pan lip, path [mm]", _tool(_PAN_LIP))),
    _bar("miscalibrated", 3, 3.0),
    _bar("miscalibrated", 7, 1.8),
    _bar("delayed", 1, 9.0, _TICKS),
    _bar("delayed", 3, 6.5),
    _bar("delayed", 7, 5.0),
    _bar("delayed_miscalibrated", 1, 11.0, _TICKS),
    _bar("delayed_miscalibrated", 5, 7.5),
    _bar("delayed_miscalibrated", 7, 6.0),
)


def motion_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return errors of the path, the bars, how the arm moved, and where iterative control wins."""
    found = by_condition(store, motion.jobs(seeds))
    tables = (_path_table, _bar_table, _manner_table, _band_table, _where_it_wins)
    return "\n\n".join(part(found) for part in tables)


def control_period_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return what the control period is worth on the default robot."""
    found = by_condition(store, motion.control_period_jobs(seeds))
    iterations = (1, 3, ITERATIONS)
    rows = []
    for condition, runs in _slowest_first(found).items():
        cells = [_spread(runs, k, _PATH[1]) for k in iterations]
        cells += [
            _spread(runs, ITERATIONS, measure)
            for measure in (_TICKS[1], _hardness, _HARDEST[1], _tool(_BRUSH_TIP))
        ]
        seconds = [row["seconds"] for run in runs for row in run["rows"][1:]]
        rows.append([condition, *cells, spread(seconds, 1.0, ".0f"), str(len(runs))])
    header = ["rate", *[f"path, k = {k}" for k in iterations], "ticks", "acceleration p99"]
    return markdown([*header, "largest", "brush tip [mm]", "s/iteration", "seeds"], rows)


def _slowest_first(found: dict[str, list[Result]]) -> dict[str, list[Result]]:
    """Return the runs by their rate of control, and the size of its model where that differs."""
    usual = motion.Rate(PERIOD)
    rates = {name: motion.OTHER_RATES.get(name, usual) for name in found}
    order = sorted(found, key=lambda name: (-rates[name].period, -rates[name].model_points))
    return {_rate_name(rates[name], usual): found[name] for name in order}


def _rate_name(rate: motion.Rate, usual: motion.Rate) -> str:
    small = rate.model_points != usual.model_points
    return f"{1.0 / rate.period:g} Hz{f', {rate.model_points} points' if small else ''}"


def _path_table(found: dict[str, list[Result]]) -> str:
    """Return errors of the path [mrad] over the trials, by every way to make it."""
    rows = []
    for robot in ROBOTS:
        name, runs = _spoken(robot), found.get(robot, [])
        if runs:
            replay = spread([run["replay"]["path"] for run in runs])
            blank = [""] * (len(_COLUMNS) - 1)
            rows.append([f"{name}: replay", replay, *blank, str(len(runs))])
        iterative = found.get(f"iterative_{robot}", [])
        for way in WAYS if iterative else ():
            errors = best_iterative(iterative, way)
            cells = [spread(errors[:, k].tolist()) for k in _COLUMNS if k < errors.shape[1]]
            rows.append([f"{name}: {_WAY_NAMES[way]}", *cells, str(len(iterative))])
        if runs:
            cells = [_spread(runs, k, _PATH[1]) for k in _COLUMNS]
            rows.append([f"{name}: learned", *cells, str(len(runs))])
    return markdown(["path [mrad]", *[f"k = {k}" for k in _COLUMNS], "seeds"], rows)


def _bar_table(found: dict[str, list[Result]]) -> str:
    """Return what each bar is held by."""
    rows = []
    for bar in BARS:
        runs = found.get(bar.robot, [])
        values = [bar.measure(run, run["rows"][bar.iteration]) for run in runs]
        within = sum(value <= SLACK * bar.limit for value in values)
        held = bool(runs) and np.median(values) <= bar.limit and within >= _SHARE * len(runs)
        rows.append(
            [
                f"{_spoken(bar.robot)}: {bar.what} at k = {bar.iteration}",
                f"≤ {bar.limit:g}",
                spread(values, 1.0),
                f"{within} of {len(runs)}",
                ("yes" if held else "no") if runs else "",
            ]
        )
    return markdown(["bar", "", "measured", f"within {SLACK:g} times", "held"], rows)


def _manner_table(found: dict[str, list[Result]]) -> str:
    """Return how the learned motion went beside its errors, and what was predicted of it."""
    measures = (
        _HARDEST[1],
        _thousandths("largest"),
        _tool(_BRUSH_TIP),
        _tool(_PAN_LIP),
    )
    rows = []
    for robot in ROBOTS:
        runs = found.get(robot, [])
        if not runs:
            continue
        shown = [run["demonstration"]["acceleration_p99"] for run in runs]
        hard = [run["rows"][ITERATIONS]["acceleration_p99"] for run in runs]
        cells = [spread(shown, 1.0), spread(hard, 1.0)]
        cells += [_spread(runs, ITERATIONS, measure) for measure in measures]
        later = [row for run in runs for row in run["rows"][2:]]
        cells.append(spread([row["prediction"] for row in later]))
        cells.append(spread([row["seconds"] for row in later], 1.0, ".0f"))
        rows.append([_spoken(robot), *cells])
    header = ["learned, k = 7", "p99 shown", "p99", "largest acceleration", "largest error [mrad]"]
    tools = ["brush tip [mm]", "pan lip [mm]"]
    predicted = ["prediction off by [mrad]", "s/iteration"]
    return markdown([*header, *tools, *predicted], rows)


def _band_table(found: dict[str, list[Result]]) -> str:
    """Return how much of each trial lay in the band predicted before it, and how much should."""
    rows = []
    for robot in ROBOTS:
        runs = found.get(robot, [])
        if not runs:
            continue
        held = np.array([[row["coverage"] for row in run["rows"][_BAND_FROM:]] for run in runs])
        means = 100.0 * held.mean(axis=0)
        true = bool((means >= _BAND[0]).all() and (means <= _BAND[1]).all())
        cells = [f"{mean:.1f}" for mean in means]
        worst = f"{100.0 * held.min():.0f} to {100.0 * held.max():.0f}"
        rows.append([_spoken(robot), *cells, worst, "yes" if true else "no"])
    columns = [f"k = {k}" for k in range(_BAND_FROM, ITERATIONS + 1)]
    header = ["in the predicted band [%], all seeds", *columns, "single trials"]
    return markdown([*header, f"{_BAND[0]:g} to {_BAND[1]:g} held"], rows)


def _where_it_wins(found: dict[str, list[Result]]) -> str:
    """Say where the median of iterative learning control is below that of what was learned."""
    wins, compared = [], []
    for robot in ROBOTS:
        runs, iterative = found.get(robot, []), found.get(f"iterative_{robot}", [])
        if not (runs and iterative):
            continue
        compared.append(_spoken(robot))
        for way in WAYS:
            errors = np.median(best_iterative(iterative, way), axis=0)
            for k in range(1, len(errors)):
                ours = float(np.median([run["rows"][k]["path"] for run in runs]))
                if errors[k] < ours:
                    numbers = f"{1e3 * errors[k]:.1f} against {1e3 * ours:.1f} mrad"
                    wins.append(f"{_spoken(robot)} at k = {k} ({_WAY_NAMES[way]}: {numbers})")
    if not compared:
        return "Iterative learning control was not measured."
    where = "; ".join(wins) if wins else "nowhere"
    return (
        f"Iterative learning control, measured on the robots {', '.join(compared)}, has the "
        f"smaller median error of the path: {where}."
    )


def _spread(runs: Sequence[Result], iteration: int, measure: Measure) -> str:
    return spread([measure(run, run["rows"][iteration]) for run in runs], 1.0)


def _spoken(robot: str) -> str:
    return robot.replace("_", " and ")
