"""The short version of the study of other speeds: one seed, one iteration, one speed."""

import pytest

from irlpilco_ros import cli
from irlpilco_ros.studies.baxter import speeds
from irlpilco_ros.studies.baxter.places_bench import PlacesBench
from irlpilco_ros.studies.result_store import ResultStore

pytestmark = pytest.mark.slow


def test_faster_than_it_was_shown_it_is_nearer_than_replay_and_nearer_still_after_a_trial():
    result = speeds.speeds_job("default", 0, iterations=1, speeds=(1.3,)).compute([])
    assert [row["where"] for row in result["rows"]] == list(speeds.WHERE)
    for row in result["rows"]:
        assert row["at_once"]["path"] < 0.5 * row["replay"]["path"]
        assert row["after_one"]["path"] < 0.8 * row["at_once"]["path"]
        assert 0.0 < row["at_once"]["predicted"] < 0.02


def test_what_is_measured_is_the_same_way_in_other_times():
    bench = PlacesBench("default", 0)
    spot = bench.at((0.0, 0.0, 0.0), 1.25)
    assert (spot.task.horizon, spot.task.speed) == (26, 1.25)
    found = spot.measure.of(spot.shown)
    assert (found["path"], max(found["tools"])) == (0.0, 0.0)
    # In a quarter less time everything changes 1.25 times as fast, and speeds 1.5625 times.
    slow = bench.home.measured(bench.home.shown)["acceleration_p99"]
    assert found["acceleration_p99"] / slow == pytest.approx(1.25**2, rel=0.2)


def trial(path):
    return {"path": path, "pieces": 19, "predicted": 0.9 * path}


def test_table_of_speeds(tmp_path, capsys):
    store = ResultStore(tmp_path)
    whens = {"replay": trial(0.02), "at_once": trial(0.003), "after_one": trial(0.001)}
    rows = [{"where": "elsewhere", "speed": 0.7, **whens}]
    store.write(speeds.speeds_job("default", 0), {"home": trial(0.001), "rows": rows})
    words = ["study", "baxter", "--experiments", "speeds", "--seeds", "1", "--tables-only"]
    assert cli.main([*words, "--out", str(tmp_path)]) == 0
    row = "| default, elsewhere, speed 0.7 | 20.0 | 19 | 3.0 | 19 | 1.0 | 19 | 2.7 | 1 |"
    assert row in capsys.readouterr().out
