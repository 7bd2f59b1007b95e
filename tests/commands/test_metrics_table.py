"""The printed table."""

from __future__ import annotations

import math

from irlpilco_ros.commands import metrics_table


def test_columns_line_up_and_what_is_unknown_is_a_dash():
    values = {"iteration": 3, "trial": 3, "rmse_rad": 0.01874, "acceleration_max": 1.26}
    values |= {"path_rmse_rad": 0.02, "path_max_rad": math.nan, "margin": 0.012}
    row = metrics_table.row({**values, "cost": math.nan, "robot_time_s": 32.0, "model_s": 1.26})
    header = metrics_table.header()
    assert len(row) == len(header)
    assert row.split() == (
        ["3", "3", "0.0200", "-", "0.0187", "-", "1.3", "1.2e-02", "-", "32", "1.3", "-"]
    )
    ends = [header.index(word) + len(word) for word in ("iteration", "trial", "margin", "cost")]
    assert all(row[end - 1] != " " for end in ends)
