"""The table of a run: one row per iteration, columns that line up."""

from __future__ import annotations

import math
from collections.abc import Mapping

COLUMNS = (
    ("iteration", "iteration", "s"),
    ("trial", "trial", "s"),
    ("path_rmse_rad", "path [rad]", ".4f"),
    ("path_max_rad", "most [rad]", ".4f"),
    ("rmse_rad", "ticks [rad]", ".4f"),
    ("acceleration_p99", "p99 [rad/s²]", ".2f"),
    ("acceleration_max", "most [rad/s²]", ".1f"),
    ("margin", "margin", ".1e"),
    ("cost", "cost", ".3g"),
    ("robot_time_s", "robot [s]", ".0f"),
    ("model_s", "model [s]", ".1f"),
    ("policy_s", "policy [s]", ".1f"),
)
"""Column of metrics.csv, heading, and format of its values; the path stands before the ticks."""


def header() -> str:
    """Return the heading."""
    return "  ".join(heading.rjust(_width(heading)) for _, heading, _ in COLUMNS)


def row(values: Mapping[str, object]) -> str:
    """Return one row; a value that is missing or not a number is shown as "-"."""
    cells = (_cell(values.get(key), form).rjust(_width(heading)) for key, heading, form in COLUMNS)
    return "  ".join(cells)


def _width(heading: str) -> int:
    return max(len(heading), 7)


def _cell(value: object, form: str) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return str(value) if form == "s" else format(float(str(value)), form)
