"""The table of the comparison with MC-PILCO: how many seeds succeed, trial by trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from irlpilco_ros.studies.cart_pole import mc_pilco
from irlpilco_ros.studies.job import FAILED, Result
from irlpilco_ros.studies.result_store import ResultStore
from irlpilco_ros.studies.tables import markdown, spread

Rows = Sequence[Result]


def mc_pilco_table(store: ResultStore, seeds: Sequence[int]) -> str:
    """Return shares of seeds that succeed in each trial and by it, and seconds of computing.

    A run that failed counts as one that never succeeds.
    """
    results = [store.read(job) for job in mc_pilco.jobs(seeds)]
    found = [result for result in results if result is not None]
    runs = [run["rows"] for run in found if FAILED not in run]
    trials = range(1, mc_pilco.TRIALS + 1)

    def share(holds: Callable[[Rows, int], bool]) -> list[str]:
        return [_share(sum(holds(rows, k) for rows in runs), len(found)) for k in trials]

    seconds = [spread([rows[k]["cpu_seconds"] for rows in runs], 1.0, ".0f") for k in trials]
    lines = [
        ["has succeeded by then", *share(_by_then)],
        ["succeeds in this trial", *share(lambda rows, k: bool(rows[k]["succeeded"]))],
        [
            "succeeds, by what was measured",
            *share(lambda rows, k: bool(rows[k]["succeeded_as_measured"])),
        ],
        ["CPU so far [s]", *seconds],
    ]
    return markdown(["classical PILCO", *[f"trial {k}" for k in trials]], lines)


def _by_then(rows: Rows, trial: int) -> bool:
    """Say whether one of the learned trials up to this one succeeded."""
    return any(row["succeeded"] for row in rows[1 : trial + 1])


def _share(count: int, total: int) -> str:
    return f"{count} of {total} ({100 * count / total:.0f} %)" if total else ""
