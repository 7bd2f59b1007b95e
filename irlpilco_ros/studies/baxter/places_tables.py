"""Tables of the sweep at other places: what came out, the bars, and where a baseline wins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.studies.baxter import movement_primitive, places
from irlpilco_ros.studies.baxter.debris import PIECES
from irlpilco_ros.studies.job import Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition, markdown, spread
from sim_bridge.tool_kinematics import TOOL_POINTS

Found = dict[str, list[Result]]
Trial = dict[str, Any]

BASELINES = {
    "replay": "replay",
    "tracking": "PD tracking",
    "iterative_alone": "iterative control",
    "iterative_with_pd": "iterative control and PD",
    "primitive": "movement primitive and PD",
}
"""Names of what was carried over without a model."""

MOST, FEW_LOST = 0.9, 18
"""At so large a share of the places at least so many pieces shall be in the pan."""

_PAN_LIP, _BRUSH_TIP = (TOOL_POINTS.index(name) for name in ("dustpan_lip", "brush_tip"))


@dataclass(frozen=True)
class Bar:
    """What the error of the path is held against, in the median over seeds and places.

    Attributes:
        robot: A key of `ROBOTS`.
        when: A key of `learned_trials`.
        limit: It shall be at most that [mrad].
    """

    robot: str
    when: str
    limit: float


AT_ONCE, AFTER_ONE = "at once", "after one trial there"

BARS = (
    Bar("default", AT_ONCE, 8.0),
    Bar("default", AFTER_ONE, 3.0),
    Bar("default", "never visited, after trials at 5 others", 4.0),
    Bar("miscalibrated", AT_ONCE, 12.0),
    Bar("miscalibrated", AFTER_ONE, 6.0),
    Bar("miscalibrated", "never visited, after trials at 5 others", 6.0),
)


def places_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return how it goes at other places, the bars, the practising, and where a baseline wins."""
    found = by_condition(store, places.jobs(seeds))
    parts = [_way_table(found), _bar_table(found), _practice_table(found)]
    parts += [_where_they_win(found), *_refusals(found)]
    if any(name.startswith("carried") for name in found) and not _primitives(found):
        parts.append(movement_primitive.MISSING)
    return "\n\n".join(parts)


def learned_trials(runs: Sequence[Result]) -> dict[str, list[Trial]]:
    """Return all trials of some runs, by what had been learned before them."""
    rows = [row for run in runs for row in run["places"]]
    trials = {
        AT_ONCE: [row["at_once"] for row in rows],
        AFTER_ONE: [row["after_one"] for row in rows if "after_one" in row],
    }
    count = len(runs[0]["practised"]) if runs else 0
    if count:
        last = [trial for run in runs for trial in run["practised"][-1]]
        trials[f"never visited, after trials at {count} others"] = last
    return trials


def practised_errors(runs: Sequence[Result]) -> list[list[float]]:
    """Return errors of the path at once [rad], after 0, 1, ... trials elsewhere.

    They are of the places that were tried after every one of these, of all runs.
    """
    watched = [row["at_once"] for run in runs for row in run["places"] if "after_one" in row]
    counts = range(len(runs[0]["practised"]))
    later = [[trial for run in runs for trial in run["practised"][k]] for k in counts]
    return [[trial["path"] for trial in trials] for trials in (watched, *later)]


def baseline_trials(runs: Sequence[Result]) -> dict[str, list[Trial | None]]:
    """Return the trials of each baseline, of all runs and places; None if one was stopped."""
    return {
        name: [trial for run in runs for trial in run[name]]
        for name in BASELINES
        if runs and all(name in run for run in runs)
    }


def _way_table(found: Found) -> str:
    rows = []
    for robot in places.PLACES_ROBOTS:
        for name, trials in baseline_trials(found.get(f"carried_{robot}", [])).items():
            rows.append([f"{robot}: {BASELINES[name]}", *_cells(trials)])
        for name, learned in learned_trials(found.get(robot, [])).items():
            told = [spread([trial["predicted"] for trial in learned])]
            told.append(spread([trial["seconds"] for trial in learned], 1.0, ".0f"))
            rows.append([f"{robot}: learned, {name}", *_cells(learned), *told])
    header = ["", "path [mrad]", "pan lip [mm]", "brush tip [mm]", f"pieces of {PIECES}"]
    rows = [[*row, *[""] * (8 - len(row))] for row in rows]
    return markdown([*header, f"≥ {FEW_LOST} pieces", "predicted [mrad]", "computing [s]"], rows)


def _cells(trials: Sequence[Trial | None]) -> list[str]:
    made = [trial for trial in trials if trial is not None]
    many = sum(trial["pieces"] >= FEW_LOST for trial in made)
    stopped = f", {len(trials) - len(made)} stopped" if len(made) < len(trials) else ""
    return [
        spread([trial["path"] for trial in made]),
        spread([trial["tools"][_PAN_LIP] for trial in made]),
        spread([trial["tools"][_BRUSH_TIP] for trial in made]),
        spread([trial["pieces"] for trial in made], 1.0, ".3g"),
        f"{many} of {len(trials)}{stopped}",
    ]


def _bar_table(found: Found) -> str:
    rows = []
    for bar in BARS:
        trials = learned_trials(found.get(bar.robot, [])).get(bar.when, [])
        errors = [1e3 * trial["path"] for trial in trials]
        held = bool(errors) and np.median(errors) <= bar.limit
        cells = [f"≤ {bar.limit:g}", spread(errors, 1.0), _yes(held, errors)]
        rows.append([f"{bar.robot}: {bar.when}, path, median [mrad]", *cells])
    for robot in places.PLACES_ROBOTS:
        trials = learned_trials(found.get(robot, []))[AT_ONCE]
        pieces = [trial["pieces"] for trial in trials]
        share = float(np.mean([count >= FEW_LOST for count in pieces])) if pieces else 0.0
        all_there = bool(pieces) and np.median(pieces) >= PIECES
        middle = [f"≥ {PIECES}", spread(pieces, 1.0, ".3g"), _yes(all_there, pieces)]
        most = [f"≥ {MOST:.0%}", f"{share:.0%}" if pieces else "", _yes(share >= MOST, pieces)]
        rows.append([f"{robot}: {AT_ONCE}, pieces in the pan, median", *middle])
        rows.append([f"{robot}: {AT_ONCE}, places with ≥ {FEW_LOST} pieces", *most])
    return markdown(["bar", "", "measured", "held"], rows)


def _yes(held: bool, measured: Sequence[float]) -> str:
    return ("yes" if held else "no") if measured else ""


def _practice_table(found: Found) -> str:
    """Return errors at once over the number of places practised [mrad]."""
    rows, count = [], 0
    for robot in places.PLACES_ROBOTS:
        runs = found.get(robot, [])
        errors = practised_errors(runs) if runs and runs[0]["practised"] else []
        count = max(count, len(errors))
        number = str(len(errors[0])) if errors else ""
        rows.append([robot, *map(spread, errors), number])
    rows = [[*row[:-1], *[""] * (count + 2 - len(row)), row[-1]] for row in rows]
    header = ["at once, path [mrad], after trials at", *map(str, range(count)), "trials"]
    return markdown(header, rows)


def _where_they_win(found: Found) -> str:
    """Say which baselines have the smaller median error of the path, and against what."""
    wins = []
    for robot in places.PLACES_ROBOTS:
        learned = {
            name: 1e3 * float(np.median([trial["path"] for trial in trials]))
            for name, trials in learned_trials(found.get(robot, [])).items()
            if trials
        }
        for name, trials in baseline_trials(found.get(f"carried_{robot}", [])).items():
            error = 1e3 * float(np.median([np.inf if t is None else t["path"] for t in trials]))
            wins += [
                f"{robot}, {BASELINES[name]} against learned, {when}: {error:.1f} against "
                f"{ours:.1f} mrad"
                for when, ours in learned.items()
                if error < ours
            ]
    return f"Where a baseline has the smaller median error: {'; '.join(wins) or 'nowhere'}."


def _primitives(found: Found) -> bool:
    return any("primitive" in run for runs in found.values() for run in runs)


def _refusals(found: Found) -> list[str]:
    """Say how many places were refused, and why; nothing if none was."""
    runs = [run for robot in places.PLACES_ROBOTS for run in found.get(robot, [])]
    refused = [each for run in runs for each in run.get("refused", [])]
    if not refused:
        return []
    count = len(refused) + sum(len(run["places"]) for run in runs)
    x, y, turn = refused[0]["place"]
    first = f"({x:g}, {y:g}) m, {turn:g} rad: {refused[0]['reason']}"
    return [f"Refused: {len(refused)} of {count} places, such as {first}."]
