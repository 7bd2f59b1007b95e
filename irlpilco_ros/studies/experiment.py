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
    """

    jobs: Callable[[Sequence[int]], list[Job]]
    table: Callable[[ResultStore, Sequence[int]], str]
