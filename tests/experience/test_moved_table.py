"""moved.csv and the file of places."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from planar_arm import planar

from irlpilco_ros.experience.moved_table import (
    COLUMNS,
    HEADER,
    MovedRow,
    read_moves,
    tool_rmse,
    write_moved,
)
from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.resources import config_file


def test_the_columns_are_those_of_the_issue_and_numbers_come_back(tmp_path):
    rows = [
        MovedRow(1, 0.05, -0.03, 0.2, 0, 0.004, 0.0045, 0.006, 0.005, 19, 20, 3.2),
        MovedRow(2, 0.5, 0.0, 0.0),
    ]
    path = tmp_path / "moved.csv"
    write_moved(path, rows)
    with path.open() as file:
        table = list(csv.DictReader(file))
    assert list(table[0]) == list(COLUMNS)
    assert ",".join(COLUMNS) == (
        "place,x,y,turn,trials_there,rmse_rad,path_rmse_rad,tool_rmse_m,predicted_rmse_rad,"
        "pieces,of_pieces,adapt_s,speed"
    )
    assert float(table[0]["path_rmse_rad"]) == 0.0045
    assert math.isnan(float(table[1]["path_rmse_rad"]))
    assert len(rows[0].line()) == len(HEADER)


def test_places_are_read_from_a_list(tmp_path):
    assert len(read_moves(config_file("places.yaml"))) == 4
    path = tmp_path / "places.yaml"
    path.write_text("- [0.1, -0.2, 0.3]\n- [0, 0, 0, 1.25]\n")
    slow, fast = read_moves(path)
    assert (slow.place, slow.speed) == ((0.1, -0.2, 0.3), 1.0)
    assert (fast.place, fast.speed) == ((0.0, 0.0, 0.0), 1.25)
    wrong = ("", "[]", "a: 1", "- [1, 2]", "- [1, 2, x]", "- [.nan, 0, 0]", "[1, 2, 3]")
    for text in (*wrong, "- [0, 0, 0, 1, 1]"):
        path.write_text(text)
        with pytest.raises(InvalidSettingError, match=r"list of \[x, y, turn\]"):
            read_moves(path)
    with pytest.raises(InvalidSettingError, match="cannot read the places"):
        read_moves(tmp_path / "none.yaml")


def test_tools_are_off_by_how_far_they_are_away():
    times, still = np.linspace(0.0, 1.0, 11), np.zeros((11, 3))
    shown = MotionPath(times, still, still)
    turned = MotionPath(times, np.add(still, (0.1, 0.0, 0.0)), still)
    assert tool_rmse(planar(), shown, shown) == 0.0
    assert tool_rmse(planar(), turned, shown) == pytest.approx(2.0 * 0.9 * np.sin(0.05))
