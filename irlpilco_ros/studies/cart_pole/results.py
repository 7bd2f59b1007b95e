"""Numbers of the cart-pole chapter: one row for every trial, and a summary of each method."""

from __future__ import annotations

import csv
import io
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.studies.cart_pole.runs import CONTROL_PERIOD, HORIZON, TrialRecord
from sim_bridge.cart_pole_simulation import CART_POLE_JOINTS

FOLLOWS_WITHIN = 0.1
"""[rad] root mean square of theta(t) within which a trial reproduces the expert."""

SETTLED = 6
"""The iteration from which on every trial is to hold the pole."""


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


def rows_of(runs: Runs) -> list[dict[str, Any]]:
    """Return one row for every trial, keys as in results.csv."""
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


def csv_table(rows: Sequence[dict[str, Any]]) -> str:
    """Return rows as CSV; a column that a row lacks is empty in it."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def summary_of(runs: Runs) -> dict[str, Any]:
    """Return the numbers of each method, keys as in results.json, with lists over the seeds."""
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
            "settled_trials": sum(len(records[SETTLED:]) for records in seeds.values()),
            "settled_held": sum(
                record.held for records in seeds.values() for record in records[SETTLED:]
            ),
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
