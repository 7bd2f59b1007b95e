"""A part of a chapter: what has to be computed for it, and the table of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from irlpilco_ros.studies.job import Job
from irlpilco_ros.studies.result_store import ResultStore


@dataclass(frozen=True)
class Experiment:
    """A part of a chapter.

    Attributes:
        jobs: From the seeds to what has to be computed.
        table: From the results and the seeds to a table in Markdown.
        learned: From a number of learned policies to the same experiment with so many in each run;
            None where that number is a part of what it is.
    """

    jobs: Callable[[Sequence[int]], list[Job]]
    table: Callable[[ResultStore, Sequence[int]], str]
    learned: Callable[[int], Experiment] | None = None
