"""The chapter's tables, each from the results that are on disk."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from irlpilco_ros.studies.baxter import (
    ablation,
    debris,
    elbows,
    hands,
    headline,
    motion,
    perturbations,
    places,
    reading,
    reproduce,
    second_robot,
    speeds,
)
from irlpilco_ros.studies.baxter.learning_run import TRIAL_SECONDS
from irlpilco_ros.studies.baxter.motion_bench import EXPERIMENT as MOTION
from irlpilco_ros.studies.baxter.motion_tables import control_period_table, motion_table
from irlpilco_ros.studies.baxter.places_tables import places_table
from irlpilco_ros.studies.experiment import Experiment
from irlpilco_ros.studies.job import Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import by_condition, markdown, spread

EARLY_BAR, LATE_BAR = (3, 0.02), (7, 0.012)
"""What the joint error is held against: after this iteration, at most so much [rad]."""

HANDS_BAR = (7, 0.005)
"""What the error of each tool point is held against [m]."""


def headline_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return joint errors [mrad] over the iterations, and how many seeds are within the bars."""
    iterations = (0, 1, 2, 3, 5, 7)
    rows = []
    for condition, runs in by_condition(store, headline.jobs(seeds)).items():
        cells = [spread([run["rows"][k]["rmse"] for run in runs]) for k in iterations]
        within = [
            f"{sum(run['rows'][k]['rmse'] <= bar for run in runs)} of {len(runs)}"
            for k, bar in (EARLY_BAR, LATE_BAR)
        ]
        replay = spread([run["replay_rmse"] for run in runs])
        rows.append([condition.replace("_", " "), replay, *cells, *within])
    bars = [f"≤ {1e3 * bar:.0f} at {k}" for k, bar in (EARLY_BAR, LATE_BAR)]
    return markdown(["robot", "replay", *[f"k = {k}" for k in iterations], *bars], rows)


def perturbations_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return the joint error [mrad] of every policy under every perturbation."""
    found = by_condition(store, perturbations.jobs(seeds))
    return _perturbations(found, ("replay", "tracking", "cloning", "defaults"))


def thesis_perturbations_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return the joint error [mrad] of what was learned with the thesis's settings."""
    return _perturbations(by_condition(store, perturbations.thesis_jobs(seeds)), ("thesis",))


def _perturbations(found: dict[str, list[Result]], names: Sequence[str]) -> str:
    suffix = "_thesis" if "thesis" in names else ""
    rows = []
    for perturbation in perturbations.perturbed_robots(0):
        runs = found.get(perturbation + suffix, [])
        cells = [spread([run[name] for run in runs]) for name in names]
        rows.append([perturbation.replace("_", " "), *cells])
    return markdown(["perturbation", *names], rows)


def debris_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return the mean number of pieces in the pan, and the ratio of learned to replay."""
    rows = []
    for robot, runs in by_condition(store, debris.jobs(seeds)).items():
        means = {name: float(np.mean([run[name] for run in runs])) for name in runs[0]}
        cells = [f"{mean:.1f}" for mean in means.values()]
        rows.append([robot, *cells, _ratio(means["learned"], means["replay"]), str(len(runs))])
    header = ["robot", "demonstration", "replay", "tracking", "cloning", "learned"]
    return markdown([*header, "learned/replay", "seeds"], rows)


def _ratio(part: float, whole: float) -> str:
    return f"{part / whole:.2f}" if whole > 0.0 else "no piece by replay"


def hands_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return how far pan lip and brush tip are off [mm], by joint and by hand features."""
    iterations = (1, 3, 5, 7)
    imitated = {
        "joints": by_condition(store, headline.jobs(seeds)),
        "hands": by_condition(store, hands.jobs(seeds)),
    }
    rows = []
    for robot in (headline.DEFAULT, headline.MISCALIBRATED):
        for features, found in imitated.items():
            runs = found.get(robot, [])
            for number, point in enumerate(("pan lip", "brush tip")):
                cells = [
                    spread([run["rows"][k]["hands"][number] for run in runs]) for k in iterations
                ]
                within = _within([run["rows"] for run in runs], HANDS_BAR, number)
                rows.append([f"{robot}, imitating {features}: {point}", *cells, within])
    bar = f"≤ {1e3 * HANDS_BAR[1]:.0f} at {HANDS_BAR[0]}"
    return markdown(["robot", *[f"k = {k}" for k in iterations], bar], rows)


def _within(runs: Sequence[Sequence[Result]], bar: tuple[int, float], point: int) -> str:
    """Return in how many runs a tool point is within a bar."""
    iteration, limit = bar
    held = sum(rows[iteration]["hands"][point] <= limit for rows in runs)
    return f"{held} of {len(runs)}"


def elbows_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return tools, pieces and joints over the iterations, by each way to weigh what was shown."""
    iterations = (1, 3, 5)
    rows = []
    for measure, (of, scale, form) in elbows.MEASURES.items():
        for variant in elbows.VARIANTS:
            jobs = [elbows.elbows_job(variant, seed) for seed in seeds]
            runs = [run for found in by_condition(store, jobs).values() for run in found]
            cells = [spread([of(run["rows"][k]) for run in runs], scale, form) for k in iterations]
            rows.append([f"{measure}: {variant}", *cells, str(len(runs))])
    return markdown(["", *[f"k = {k}" for k in iterations], "seeds"], rows)


def speeds_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return the error of the path [mrad] at other speeds than the shown one, and the pieces."""
    rows = []
    for robot, runs in by_condition(store, speeds.jobs(seeds)).items():
        for number, first in enumerate(runs[0]["rows"]):
            found = [run["rows"][number] for run in runs]
            cells = []
            for when in ("replay", "at_once", "after_one"):
                cells.append(spread([row[when]["path"] for row in found]))
                cells.append(spread([row[when]["pieces"] for row in found], 1.0, ".0f"))
            predicted = spread([row["at_once"]["predicted"] for row in found])
            words = f"{robot}, {first['where']}, speed {first['speed']:g}"
            rows.append([words, *cells, predicted, str(len(runs))])
    whens = ["replay", "at once", "after one trial"]
    header = [name for when in whens for name in (f"{when}: path", "pieces")]
    return markdown(["robot", *header, "predicted at once", "seeds"], rows)


def ablation_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return joint errors [mrad] of every variant, and the time for an iteration."""
    iterations = (1, 3, 5)
    rows = []
    for variant, runs in by_condition(store, ablation.jobs(seeds)).items():
        cells = [spread([run["rows"][k]["rmse"] for run in runs]) for k in iterations]
        rows.append([variant.replace("_", " "), *cells, _seconds(runs), str(len(runs))])
    header = ["changed", *[f"k = {k}" for k in iterations], "s/iteration", "seeds"]
    return markdown(header, rows)


def second_robot_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return joint errors [mrad] of wiping with another arm."""
    rows = []
    for robot, runs in by_condition(store, second_robot.jobs(seeds)).items():
        cells = [
            spread([run["rows"][k]["rmse"] for run in runs])
            for k in range(second_robot.ITERATIONS + 1)
        ]
        replay = spread([run["replay_rmse"] for run in runs])
        rows.append([robot, replay, *cells, str(len(runs))])
    iterations = [f"k = {k}" for k in range(second_robot.ITERATIONS + 1)]
    return markdown(["arm", "replay", *iterations, "seeds"], rows)


def reproduce_table(
    store: ResultStore, seeds: Sequence[int], iterations: int = reproduce.ITERATIONS
) -> str:
    """Return the error (6.1) [1e-3 rad^2] over the iterations, robot and computing time."""
    shown = [k for k in (0, 1, 4, 7, 10, 15) if k < iterations] + [iterations]
    found = by_condition(store, reproduce.jobs(seeds, iterations))
    rows = []
    for method, hours in reproduce.THESIS_HOURS.items():
        name = method.replace("_", " ")
        for settings in ("thesis", "default"):
            runs = found.get(f"{settings}_{method}", [])
            cells = [spread([run["rows"][k]["mse"] for run in runs], form=".3g") for k in shown]
            times = [_robot_time(runs), spread([_computing(run) for run in runs], 1.0, ".0f")]
            rows.append([f"{name}, {settings}", *cells, *times, str(len(runs))])
        blank = [""] * (len(shown) + 1)
        rows.append([f"{name}, reported", *blank, str(3600 * hours), ""])
    header = ["method, settings", *[f"k = {k}" for k in shown]]
    return markdown([*header, "robot time [s]", "computing [s]", "seeds"], rows)


def _robot_time(runs: Sequence[Result]) -> str:
    """Return how long the robot moved for all trials of a run [s]."""
    return f"{TRIAL_SECONDS * len(runs[0]['rows']):.0f}" if runs else ""


def _computing(run: Result) -> float:
    """Return the time of learning of a whole run [s]."""
    return float(sum(row["model_seconds"] + row["policy_seconds"] for row in run["rows"]))


def _seconds(runs: Sequence[Result]) -> str:
    """Return the mean time of one iteration of learning [s]."""
    return f"{np.mean([_computing(run) / (len(run['rows']) - 1) for run in runs]):.1f}"


def _reproduce(iterations: int) -> Experiment:
    jobs = partial(reproduce.jobs, iterations=iterations)
    return Experiment(jobs, partial(reproduce_table, iterations=iterations), _reproduce)


def _reading(iterations: int) -> Experiment:
    jobs = partial(reading.jobs, iterations=iterations)
    return Experiment(jobs, partial(reading.table, iterations=iterations), _reading)


EXPERIMENTS = {
    MOTION: Experiment(motion.jobs, motion_table),
    places.EXPERIMENT: Experiment(places.jobs, places_table),
    speeds.EXPERIMENT: Experiment(speeds.jobs, speeds_table),
    motion.CONTROL_PERIOD: Experiment(motion.control_period_jobs, control_period_table),
    headline.EXPERIMENT: Experiment(headline.jobs, headline_table),
    perturbations.EXPERIMENT: Experiment(perturbations.jobs, perturbations_table),
    debris.EXPERIMENT: Experiment(debris.jobs, debris_table),
    hands.EXPERIMENT: Experiment(hands.jobs, hands_table),
    elbows.EXPERIMENT: Experiment(elbows.jobs, elbows_table),
    second_robot.EXPERIMENT: Experiment(second_robot.jobs, second_robot_table),
    ablation.EXPERIMENT: Experiment(ablation.jobs, ablation_table),
    reproduce.EXPERIMENT: _reproduce(reproduce.ITERATIONS),
    reading.EXPERIMENT: _reading(reading.ITERATIONS),
    "thesis_perturbations": Experiment(perturbations.thesis_jobs, thesis_perturbations_table),
}
"""The parts by name: motion, places and speeds, then all others in the order of what they cost."""
