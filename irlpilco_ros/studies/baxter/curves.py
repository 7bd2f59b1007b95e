"""Curves over iterations: the median over seeds, and the range between the extreme ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.report import style
from irlpilco_ros.studies.job import Result

LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.ORANGE, "linestyle": "-", "marker": "o"},
    {"color": style.BLUE, "linestyle": (0, (5, 2)), "marker": "s"},
    {"color": style.FAINT, "linestyle": (0, (1, 2)), "marker": "^"},
)


def over_iterations(runs: Sequence[Result], key: str) -> Array:
    """Return a number of every row of every run, shape (seeds, iterations + 1)."""
    return np.array([[row[key] for row in run["rows"]] for run in runs])


def median_and_range(axes: Axes, places: Array, values: Array, label: str, number: int) -> None:
    """Draw values (seeds, n) over places (n,), in the look of that number.

    The range is a band with edges in the curve's own line style, which tell two bands apart where
    colours do not.
    """
    look = LOOKS[number]
    low, high = values.min(axis=0), values.max(axis=0)
    axes.fill_between(places, low, high, color=look["color"], alpha=0.15, linewidth=0)
    for edge in (low, high):
        axes.plot(
            places, edge, color=look["color"], linestyle=look["linestyle"], linewidth=0.5, alpha=0.7
        )
    axes.plot(places, np.median(values, axis=0), label=label, markersize=4.5, **look)
