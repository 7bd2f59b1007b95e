"""The page of the cart-pole chapter: results.json, results.csv, index.md, pictures.

The page is templates/index.md.j2; its numbers are those of results.py.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.report.templating import render
from irlpilco_ros.studies.cart_pole import figures
from irlpilco_ros.studies.cart_pole.results import (
    Runs,
    csv_table,
    feature_error,
    rows_of,
    summary_of,
)
from irlpilco_ros.studies.cart_pole.runs import CONTROL_PERIOD, HORIZON
from sim_bridge.cart_pole_equations import CartPoleParameters

SHOWN_ITERATIONS = (4, 15)
"""Those that the thesis shows in figures 4.3-4.8."""


@dataclass(frozen=True)
class SeedRow:
    """One run as a row of the table of seeds; "" where a column does not apply."""

    method: str
    seed: int
    held: str
    best: float | str
    last: float | str
    computing: float
    cpu: float


@dataclass(frozen=True)
class Pictures:
    """METHOD.png and METHOD.gif, drawn from the runs of one seed."""

    method: str
    seed: int


def write_page(out: Path, runs: Runs) -> Path:
    """Write everything into the folder and return the page's path.

    results.json has `rows`, one for every trial, as results.csv: method ("expert",
    "feature_matching", "feature_expectations"), seed, iteration (0 is the first trial, before
    anything was learned), held, tip_worst_of_last_second_m [m], computing_s and computing_cpu_s
    [s] of its policy, robot_s [s] so far; and for imitation theta_rms_rad [rad] and error_6_1, the
    mean squared error (6.1) over the features (x, sin, cos) and the steps t = 1..H. Besides, a
    summary by the name of each method, with lists over the seeds in `seeds`.
    """
    rows, summary = rows_of(runs), summary_of(runs)
    _write(out / "results.json", json.dumps({"rows": rows, **summary}, indent=1))
    _write(out / "results.csv", csv_table(rows))
    page = out / "index.md"
    _write(page, _render(summary, _draw(out, runs)))
    return page


def _render(summary: Mapping[str, Any], pictures: Sequence[Pictures]) -> str:
    filters: dict[str, Callable[..., object]] = {
        "median": statistics.median,
        "median_and_largest": _median_and_largest,
        "trials": _trials,
        "words": _words,
    }
    return render(
        "irlpilco_ros.studies.cart_pole",
        "index.md.j2",
        filters,
        trial_time=HORIZON * CONTROL_PERIOD,
        expert=summary["expert"],
        methods={name: values for name, values in summary.items() if name != "expert"},
        seeds=list(_seed_rows(summary)),
        pictures=pictures,
        until_held=_until_held,
    )


def _words(name: str) -> str:
    return name.replace("_", " ")


def _median_and_largest(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.0f}, {max(values):.0f}"


def _trials(iterations: Sequence[int | None]) -> list[int | None]:
    """Return how many trials were made by each iteration; that of index 0 is one."""
    return [None if iteration is None else iteration + 1 for iteration in iterations]


def _until_held(trials: Sequence[int | None], values: Mapping[str, Any]) -> str:
    """Say what it takes to hold first; nothing if half of the seeds never do."""
    count, seconds = (
        statistics.median(math.inf if value is None else value for value in column)
        for column in (trials, values["computing_until_held_s"])
    )
    if not math.isfinite(count):
        return ""
    return f"{count:g}, {count * HORIZON * CONTROL_PERIOD:g}, {seconds:.0f}"


def _seed_rows(summary: Mapping[str, Any]) -> Iterator[SeedRow]:
    for method, values in summary.items():
        is_expert = method == "expert"
        none = [""] * len(values["seeds"])
        columns = zip(
            values["seeds"],
            values["trials" if is_expert else "first_held"],
            values.get("theta_rms_best_rad", none),
            values.get("theta_rms_last_rad", none),
            values["computing_s"],
            values["computing_cpu_s"],
            strict=True,
        )
        unit = "trial" if is_expert else "iteration"
        for seed, first, *others in columns:
            held = "not" if first is None else f"{unit} {first}"
            yield SeedRow(method, seed, held, *others)


def _draw(out: Path, runs: Runs) -> list[Pictures]:
    """Draw the figures; return which methods they are of."""
    drawn = []
    for method, seeds in runs.imitation.items():
        seed, records = next(iter(seeds.items()))
        shown = [
            figures.Shown(f"iteration {k}", records[k].rollout.states, records[k].prediction)
            for k in sorted({min(k, len(records) - 1) for k in (1, *SHOWN_ITERATIONS)})
        ]
        figure = figures.trials_figure(runs.demonstration.states, shown, CONTROL_PERIOD)
        figure.savefig(out / f"{method}.png", dpi=130)
        films = [("expert", runs.demonstration.states), (shown[-1].title, shown[-1].states)]
        film = figures.animation(films, CONTROL_PERIOD, CartPoleParameters().length)
        write_atomically(out / f"{method}.gif", film)
        drawn.append(Pictures(method, seed))
    if drawn:
        errors = {
            _words(method): [
                [feature_error(runs.demonstration, record) for record in records[1:]]
                for records in seeds.values()
            ]
            for method, seeds in runs.imitation.items()
        }
        figures.errors_figure(errors).savefig(out / "errors.png", dpi=130)
    return drawn


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, text.encode())
