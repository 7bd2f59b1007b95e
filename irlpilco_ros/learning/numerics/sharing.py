"""How work is shared among threads: what is worth it, and in which parts.

Parts follow from sizes alone, never from the number of threads, so that results have the same bits
however many threads work.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import lru_cache
from typing import TypeVar

import numpy as np

from irlpilco_ros.learning.numerics.threads import one_blas_thread, run_parallel

Result = TypeVar("Result")

_GROUPS = 2  # of outputs; more would make each numpy call too short
_WORTH_GROUPING = 3_000_000  # multiplications; one thread is as fast with fewer
_WORTH_A_THREAD = 160  # rows of a matrix


@lru_cache(maxsize=64)
def even_slices(count: int, parts: int) -> tuple[slice, ...]:
    """Cut `count` items into at most `parts` slices of about equal length, none of them empty."""
    edges = np.linspace(0, count, parts + 1).astype(int).tolist()
    return tuple(slice(a, b) for a, b in itertools.pairwise(edges) if a < b)


def output_groups(outputs: int, multiplications: int) -> tuple[slice, ...]:
    """Return the groups of outputs that a prediction works on together.

    Args:
        outputs: E.
        multiplications: Of all outputs together, in one prediction.
    """
    return even_slices(outputs, _GROUPS if multiplications > _WORTH_GROUPING else 1)


def for_each_output(
    function: Callable[[int], Result], outputs: int, rows: int, threads: int
) -> list[Result]:
    """Return [function(a) for a in range(outputs)], each a work on rows x rows matrices.

    Smaller matrices keep numpy so briefly that threads wait for each other's interpreter lock
    longer than they work (measured: training on 64 points takes two threads twice as long as one).
    """
    with one_blas_thread():
        return run_parallel(function, range(outputs), threads if rows >= _WORTH_A_THREAD else 1)
