"""Tables of results: medians over seeds, and the worst seed beside them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from irlpilco_ros.studies.job import FAILED, Job, Result
from irlpilco_ros.studies.result_store import ResultStore


def by_condition(store: ResultStore, jobs: Iterable[Job]) -> dict[str, list[Result]]:
    """Return the results that there are, by condition, in the order of the jobs; no failed ones."""
    found: dict[str, list[Result]] = {}
    for job in jobs:
        result = store.read(job)
        if result is not None and FAILED not in result:
            found.setdefault(job.condition, []).append(result)
    return found


def state_of(store: ResultStore, jobs: Sequence[Job]) -> str:
    """Return a sentence that says how many results there are, and which seeds failed and why."""
    results = [store.read(job) for job in jobs]
    there = sum(result is not None for result in results)
    failed: dict[str, list[tuple[int, str]]] = {}
    for job, result in zip(jobs, results, strict=True):
        if result is not None and FAILED in result:
            failed.setdefault(job.condition, []).append((job.seed, result[FAILED]))
    text = f"{there} of {len(jobs)} runs."
    for condition, cases in failed.items():
        seeds = ", ".join(str(seed) for seed, _ in cases)
        text += f" Failed: {condition}, seed {seeds}: {cases[0][1]}"
    return text


def spread(values: Sequence[float], scale: float = 1e3, form: str = ".1f") -> str:
    """Return "median (smallest to largest)" of some values, times a scale, in that form."""
    numbers = scale * np.asarray(values, dtype=float)
    if numbers.size == 0:
        return ""
    median = f"{np.median(numbers):{form}}"
    if numbers.size == 1:
        return median
    return f"{median} ({numbers.min():{form}} to {numbers.max():{form}})"


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown: the first column to the left, all others to the right."""
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
