"""Numbers and figures of the cart-pole chapter: results.json, results.csv, index.md, pictures."""

from __future__ import annotations

import csv
import io
import json
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.studies.cart_pole import figures
from irlpilco_ros.studies.cart_pole.runs import CONTROL_PERIOD, HORIZON, TrialRecord
from sim_bridge.cart_pole_equations import CartPoleParameters
from sim_bridge.cart_pole_simulation import CART_POLE_JOINTS

SHOWN_ITERATIONS = (4, 15)
"""Those that the thesis shows in figures 4.3-4.8."""

FOLLOWS_WITHIN = 0.1
"""[rad] root mean square of theta(t) within which a trial reproduces the expert."""


@dataclass(frozen=True)
class Runs:
    """All runs of the chapter.

    Attributes:
        demonstration: What was imitated.
        expert: Trials of the expert by seed.
        imitation: Trials by method and seed.
    """

    demonstration: Rollout
    expert: dict[int, list[TrialRecord]]
    imitation: dict[str, dict[int, list[TrialRecord]]]


def theta_rms(demonstration: Rollout, record: TrialRecord) -> float:
    """Return the root mean square of theta(t) minus the expert's, t = 1..H [rad]."""
    difference = record.rollout.states[1:, 1] - demonstration.states[1:, 1]
    return float(np.sqrt(np.mean(difference**2)))


def feature_error(demonstration: Rollout, record: TrialRecord) -> float:
    """Return the error (6.1): mean square over features (x, sin, cos) and steps t = 1..H."""
    features = JointPositions.of_robot(CART_POLE_JOINTS)
    difference = features.of(record.rollout.states) - features.of(demonstration.states)
    return float(np.mean(difference[1:] ** 2))


def expert_line(seed: int, records: Sequence[TrialRecord]) -> str:
    """Say how an expert fared."""
    count = len(records)
    end = f"held in trial {count}" if records[-1].held else f"not held in {count} trials"
    return f"expert, seed {seed}: {end}; {_computing(records)}"


def imitation_line(
    method: str, seed: int, demonstration: Rollout, records: Sequence[TrialRecord]
) -> str:
    """Say how an imitation fared."""
    first = first_held(records)
    held = "never held" if first is None else f"first held in iteration {first}"
    last = records[-1]
    return (
        f"{method}, seed {seed}: {held}; after iteration {len(records) - 1} "
        f"theta {theta_rms(demonstration, last):.3f} rad off, "
        f"{'held' if last.held else 'not held'}; {_computing(records)}"
    )


def _computing(records: Sequence[TrialRecord]) -> str:
    seconds = sum(record.seconds for record in records)
    cpu_seconds = sum(record.cpu_seconds for record in records)
    return f"{seconds:.0f} s computing ({cpu_seconds:.0f} s of CPU)"


def first_held(records: Sequence[TrialRecord]) -> int | None:
    """Return the first iteration whose trial held the pole; None if there is none."""
    return next((k for k, record in enumerate(records) if k and record.held), None)


def write_page(out: Path, runs: Runs) -> Path:
    """Write everything into the folder and return the page's path.

    results.json has `rows`, one for every trial, as results.csv: method ("expert",
    "feature_matching", "feature_expectations"), seed, iteration (0 is the first trial, before
    anything was learned), held, tip_worst_of_last_second_m [m], computing_s and computing_cpu_s
    [s] of its policy, robot_s [s] so far; and for imitation theta_rms_rad [rad] and error_6_1, the
    mean squared error (6.1) over the features (x, sin, cos) and the steps t = 1..H. Besides, a
    summary by the name of each method, with lists over the seeds in `seeds`.
    """
    rows = _rows(runs)
    _write(out / "results.json", json.dumps({"rows": rows, **_summary(runs)}, indent=1))
    _write(out / "results.csv", _csv(rows))
    pictures = _pictures(out, runs)
    page = out / "index.md"
    _write(page, "\n".join([*_table(runs), "", *pictures, ""]))
    return page


def _rows(runs: Runs) -> list[dict[str, Any]]:
    """Return one row for every trial."""
    rows = []
    families = {"expert": runs.expert, **runs.imitation}
    for method, seeds in families.items():
        for seed, records in seeds.items():
            for index, record in enumerate(records):
                row: dict[str, Any] = {
                    "method": method,
                    "seed": seed,
                    "iteration": index,
                    "held": record.held,
                    "tip_worst_of_last_second_m": round(record.worst_of_last_second, 4),
                    "computing_s": round(record.seconds, 2),
                    "computing_cpu_s": round(record.cpu_seconds, 2),
                    "robot_s": round((index + 1) * HORIZON * CONTROL_PERIOD, 3),
                }
                if method != "expert":
                    row["theta_rms_rad"] = round(theta_rms(runs.demonstration, record), 4)
                    row["error_6_1"] = round(feature_error(runs.demonstration, record), 6)
                rows.append(row)
    return rows


def _csv(rows: Sequence[dict[str, Any]]) -> str:
    columns = list(dict.fromkeys(name for row in rows for name in row))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def _summary(runs: Runs) -> dict[str, Any]:
    """Return the numbers of the table."""
    trials = [len(r) if r[-1].held else math.inf for r in runs.expert.values()]
    summary: dict[str, Any] = {
        "expert": {
            "seeds": list(runs.expert),
            "trials": [count if math.isfinite(count) else None for count in trials],
            "held_within_7_trials": sum(count <= 7 for count in trials),
            "median_trials": statistics.median(trials),
            **_times(runs.expert),
        }
    }
    for method, seeds in runs.imitation.items():
        firsts = [first_held(records) for records in seeds.values()]
        reached = [
            min((theta_rms(runs.demonstration, t) for t in records[1:]), default=math.nan)
            for records in seeds.values()
        ]
        last = [theta_rms(runs.demonstration, records[-1]) for records in seeds.values()]
        summary[method] = {
            "seeds": list(seeds),
            "iterations": max(len(records) - 1 for records in seeds.values()),
            "first_held": firsts,
            "held_by_4": sum(first is not None and first <= 4 for first in firsts),
            "theta_rms_last_rad": [round(value, 3) for value in last],
            "theta_rms_best_rad": [round(value, 3) for value in reached],
            "follows_by_the_end": sum(value <= FOLLOWS_WITHIN for value in reached),
            "follows_at_the_end": sum(value <= FOLLOWS_WITHIN for value in last),
            "held_at_the_end": sum(records[-1].held for records in seeds.values()),
            **_times(seeds),
        }
    return summary


def _times(seeds: Mapping[int, Sequence[TrialRecord]]) -> dict[str, list[float | None]]:
    """Return what each seed took: all of its computing, and all it took to hold first, if ever."""
    firsts = [(first_held(records), records) for records in seeds.values()]
    return {
        "computing_s": [_seconds(records) for records in seeds.values()],
        "computing_cpu_s": [round(sum(t.cpu_seconds for t in r), 1) for r in seeds.values()],
        "computing_until_held_s": [
            None if first is None else _seconds(records[: first + 1]) for first, records in firsts
        ],
    }


def _seconds(records: Sequence[TrialRecord]) -> float:
    return round(sum(record.seconds for record in records), 1)


def _table(runs: Runs) -> list[str]:
    summary = _summary(runs)
    expert = summary["expert"]
    lines = [
        "# The cart-pole chapter",
        "",
        f"Trials of {HORIZON * CONTROL_PERIOD:g} s; held: the tip within 0.15 m of the point above "
        "the track's origin for the last second.",
        "",
        "| | seeds | held | held at the end | theta within 0.1 rad by then, at the end | "
        "median theta RMS at the end [rad] | computing: median, largest [s] | "
        "of CPU: median, largest [s] | until first held: median trials, robot [s], computing [s] |",
        "|---|---|---|---|---|---|---|---|---|",
        f"| expert (classical PILCO) | {len(expert['seeds'])} | {expert['held_within_7_trials']} "
        f"within 7 trials, median {expert['median_trials']:g} | | | | {_middle_and_most(expert)} | "
        f"{_until_held(expert['trials'], expert)} |",
    ]
    for method in runs.imitation:
        values = summary[method]
        trials = [None if first is None else first + 1 for first in values["first_held"]]
        lines.append(
            f"| {method.replace('_', ' ')}, {values['iterations']} iterations | "
            f"{len(values['seeds'])} | "
            f"{values['held_by_4']} by iteration 4 | {values['held_at_the_end']} | "
            f"{values['follows_by_the_end']}, {values['follows_at_the_end']} | "
            f"{statistics.median(values['theta_rms_last_rad']):.3f} | {_middle_and_most(values)} | "
            f"{_until_held(trials, values)} |"
        )
    return [*lines, "", *_seeds_table(summary, list(runs.imitation))]


def _middle_and_most(values: Mapping[str, Any]) -> str:
    return " | ".join(
        f"{statistics.median(values[name]):.0f}, {max(values[name]):.0f}"
        for name in ("computing_s", "computing_cpu_s")
    )


def _until_held(trials: Sequence[int | None], values: Mapping[str, Any]) -> str:
    """Say what it takes to hold first; nothing if half of the seeds never do."""
    count, seconds = (
        statistics.median(math.inf if value is None else value for value in column)
        for column in (trials, values["computing_until_held_s"])
    )
    if not math.isfinite(count):
        return ""
    return f"{count:g}, {count * HORIZON * CONTROL_PERIOD:g}, {seconds:.0f}"


def _seeds_table(summary: Mapping[str, Any], methods: Sequence[str]) -> list[str]:
    """Return the lines of a table with one row for each run."""
    lines = [
        "| method | seed | first held in | best theta RMS [rad] | theta RMS at the end [rad] | "
        "computing [s] | of CPU [s] |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in ("expert", *methods):
        values, none = summary[name], ["" for _ in summary[name]["seeds"]]
        columns = zip(
            values["seeds"],
            values["trials" if name == "expert" else "first_held"],
            values.get("theta_rms_best_rad", none),
            values.get("theta_rms_last_rad", none),
            values["computing_s"],
            values["computing_cpu_s"],
            strict=True,
        )
        unit = "trial" if name == "expert" else "iteration"
        for seed, first, *others in columns:
            held = "not" if first is None else f"{unit} {first}"
            cells = [name.replace("_", " "), seed, held, *others]
            lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    return lines


def _pictures(out: Path, runs: Runs) -> list[str]:
    """Draw the figures; return the lines of the page that show them."""
    lines = []
    for method, seeds in runs.imitation.items():
        seed, records = next(iter(seeds.items()))
        shown = [
            figures.Shown(f"iteration {k}", records[k].rollout.states, records[k].prediction)
            for k in sorted({min(k, len(records) - 1) for k in (1, *SHOWN_ITERATIONS)})
        ]
        figure = figures.trials_figure(runs.demonstration.states, shown, CONTROL_PERIOD)
        figure.savefig(out / f"{method}.png", dpi=130)
        lines += [
            f"Thesis 4.3-4.8, {method.replace('_', ' ')}, seed {seed}:",
            "",
            f"![trials]({method}.png)",
            "",
        ]
        name = f"{method}.gif"
        films = [("expert", runs.demonstration.states), (shown[-1].title, shown[-1].states)]
        write_atomically(
            out / name,
            figures.animation(films, CONTROL_PERIOD, CartPoleParameters().length),
        )
        lines += [f"![animation]({name})", ""]
    if runs.imitation:
        errors = {
            method.replace("_", " "): [
                [feature_error(runs.demonstration, record) for record in records[1:]]
                for records in seeds.values()
            ]
            for method, seeds in runs.imitation.items()
        }
        figures.errors_figure(errors).savefig(out / "errors.png", dpi=130)
        lines += ["The cart-pole half of thesis 6.1:", "", "![errors](errors.png)", ""]
    return lines


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, text.encode())
