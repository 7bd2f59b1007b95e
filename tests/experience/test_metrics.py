from __future__ import annotations

import math
from dataclasses import replace

import pytest

from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.metrics import (
    COLUMNS,
    DEMONSTRATION,
    MetricsRow,
    append_metrics,
    read_metrics,
)


def row(iteration: int | None, trial: int = 0, rmse: float = 0.1) -> MetricsRow:
    return MetricsRow(
        iteration, trial, rmse, rmse**2, 1.5, 2.5, 8.0, 1 / 3, 0.25, 2 / 7, 0.5, 1.25, 30.0
    )


def test_rows_come_back_with_all_their_digits(tmp_path):
    path = tmp_path / "metrics.csv"
    assert read_metrics(path) == ()
    shown = replace(row(None), baseline=DEMONSTRATION)
    rows = (shown, row(0), row(None), row(1, trial=2, rmse=1 / 7))
    for each in rows:
        append_metrics(path, each)
    assert read_metrics(path) == rows
    lines = path.read_text().splitlines()
    assert lines[0] == (
        "iteration,trial,rmse_rad,mse,margin,cost,robot_time_s,model_s,policy_s,"
        "path_rmse_rad,path_max_rad,acceleration_p99,acceleration_max"
    )
    assert [line.split(",")[0] for line in lines[1:]] == ["demonstration", "0", "replay", "1"]


def test_a_run_from_before_the_path_was_measured_goes_on(tmp_path):
    path = tmp_path / "metrics.csv"
    path.write_text(
        "iteration,trial,rmse_rad,mse,margin,cost,robot_time_s,model_s,policy_s\n"
        "replay,0,0.2,0.04,nan,nan,0.0,0.0,0.0\n"
        "0,0,0.1,0.01,1.5,nan,8.0,0.0,0.0\n"
    )
    append_metrics(path, row(1))
    replay, before, after = read_metrics(path)
    assert (replay.name, before.rmse_rad, after) == ("replay", 0.1, row(1))
    assert math.isnan(before.path_rmse_rad)
    assert all(line.count(",") == len(COLUMNS) - 1 for line in path.read_text().splitlines())


def test_an_initial_trial_has_no_cost(tmp_path):
    path = tmp_path / "metrics.csv"
    append_metrics(path, MetricsRow(0, 0, 0.1, 0.01, math.nan, math.nan, 8.0, 0.0, 0.0))
    (read,) = read_metrics(path)
    assert math.isnan(read.cost)


def test_a_row_is_never_replaced(tmp_path):
    path = tmp_path / "metrics.csv"
    append_metrics(path, row(3))
    with pytest.raises(RunDirectoryError, match="has a row for iteration 3 already"):
        append_metrics(path, row(3, rmse=0.2))
    append_metrics(path, row(None))
    with pytest.raises(RunDirectoryError, match="has a row for replay already"):
        append_metrics(path, row(None))


@pytest.mark.parametrize("cut", range(1, 40, 3))
def test_a_torn_last_line_is_passed_over(tmp_path, cut):
    path = tmp_path / "metrics.csv"
    append_metrics(path, row(0))
    append_metrics(path, row(1))
    text = path.read_text()
    last = text.splitlines()[-1]
    torn = last[: max(1, len(last) - cut)]
    path.write_text(text[: -len(last) - 1] + torn)
    read = read_metrics(path)
    assert read[0] == row(0)
    assert len(read) == (2 if torn.count(",") == len(COLUMNS) - 1 and torn[-1] != "," else 1)


def test_nonsense_inside_is_an_error(tmp_path):
    path = tmp_path / "metrics.csv"
    append_metrics(path, row(0))
    path.write_text(path.read_text() + "1,nonsense\n" + "2,0" + 11 * ",1" + "\n")
    with pytest.raises(RunDirectoryError, match="line 3: '1,nonsense' is no row"):
        read_metrics(path)
    path.write_text("other,columns\n")
    with pytest.raises(RunDirectoryError, match="does not start with the columns"):
        read_metrics(path)
