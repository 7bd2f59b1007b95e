"""What is exported is what was recorded, read back by the rules of each format."""

from __future__ import annotations

import csv
import json
import sys

import numpy as np
import pytest
from report_runs import LATE, demonstrated, write_run

from irlpilco_ros.cli import main
from irlpilco_ros.experience.episodes import common_rate, episodes_of_run

JOINTS = ("shoulder", "elbow")
POSITIONS = demonstrated(2, 4)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "demo", JOINTS, POSITIONS)


def test_csv_has_every_joint_state(run, tmp_path, capsys):
    folder = tmp_path / "tables"
    assert main(["export", str(run.path), "--csv", str(folder)]) == 0
    assert capsys.readouterr().out == f"{folder}: 4 tables\n"
    with (folder / "trial_001.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["time"]) for row in rows] == [0.0, 0.5, 1.0, 1.5, 2.0]
    found = [[float(row[f"{joint} position"]) for joint in JOINTS] for row in rows]
    np.testing.assert_allclose(found, POSITIONS + 2.0 * LATE, atol=1e-8)
    assert [row["elbow command"] for row in rows] == ["0.25", "0.25", "0.25", "0.25", "0"]
    with (folder / "demonstration_000.csv").open() as stream:
        assert next(csv.DictReader(stream))["elbow command"] == ""


def test_a_recording_between_decisions_is_told_at_its_own_rate(repository):
    (episode,) = episodes_of_run(repository / "bags/sweep/trials/001")
    assert common_rate([episode]) == 50
    frames = episode.at(50)
    np.testing.assert_allclose(np.diff(frames.times), 0.02, atol=1e-12)
    assert frames.times[-1] <= episode.times[-1] + 1e-9
    # A decision is held until the next: the commands change every 0.25 s.
    changes = np.flatnonzero(np.abs(np.diff(frames.commands, axis=0)).max(axis=1) > 0.0)
    assert np.diff(frames.times[changes]).min() > 0.2


def test_what_is_there_stays_and_no_format_is_wrong(run, tmp_path, capsys):
    (tmp_path / "mine").mkdir()
    assert main(["export", str(run.path), "--csv", str(tmp_path / "mine")]) == 1
    assert "is there already" in capsys.readouterr().err
    assert main(["export", str(run.path)]) == 1
    assert "--csv DIR, --lerobot DIR" in capsys.readouterr().err
    assert main(["export", str(tmp_path / "none"), "--csv", str(tmp_path / "a")]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "a").exists()


def test_without_pyarrow_it_says_what_to_install(run, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert main(["export", str(run.path), "--lerobot", str(tmp_path / "a")]) == 1
    assert "pip install pyarrow" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


@pytest.fixture
def dataset(run, tmp_path):
    pytest.importorskip("pyarrow", reason="pyarrow, which writes parquet, is not installed")
    folder = tmp_path / "dataset"
    words = ["--lerobot", str(folder), "--task", "sweep", "--robot-type", "toy"]
    assert main(["export", str(run.path), *words]) == 0
    return folder


def read(path):
    from pyarrow import parquet

    return parquet.read_table(path)


def test_a_lerobot_dataset_is_found_by_its_own_description(dataset):
    info = json.loads((dataset / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert (info["fps"], info["total_episodes"], info["total_tasks"]) == (2, 4, 1)
    assert info["splits"] == {"train": "0:4"}
    assert info["features"]["observation.state"]["names"] == list(JOINTS)
    episodes = read(dataset / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert sum(each["length"] for each in episodes) == info["total_frames"] == 20
    for each in episodes:
        file = info["data_path"].format(
            chunk_index=each["data/chunk_index"], file_index=each["data/file_index"]
        )
        rows = read(dataset / file).to_pylist()[
            each["dataset_from_index"] : each["dataset_to_index"]
        ]
        assert len(rows) == each["length"]
        assert {row["episode_index"] for row in rows} == {each["episode_index"]}
        assert each["tasks"] == ["sweep"]


def test_its_frames_are_what_was_recorded_with_the_types_it_names(dataset):
    info = json.loads((dataset / "meta/info.json").read_text())
    table = read(dataset / "data/chunk-000/file-000.parquet")
    assert set(table.column_names) == set(info["features"])
    for name, feature in info["features"].items():
        kind, size = str(table.schema.field(name).type), feature["shape"][0]
        expected = {"float32": "float", "int64": "int64"}[feature["dtype"]]
        wanted = f"fixed_size_list<element: {expected}>[{size}]" if size > 1 else expected
        assert kind.replace("item", "element") == wanted
    rows = table.to_pylist()
    assert [row["index"] for row in rows] == list(range(20))
    for row in rows:
        assert row["timestamp"] == pytest.approx(row["frame_index"] / info["fps"], abs=1e-4)
        assert row["task_index"] == 0
    third = [row["observation.state"] for row in rows if row["episode_index"] == 3]
    np.testing.assert_allclose(third, POSITIONS + 3.0 * LATE, atol=1e-6)
    assert rows[5]["action"] == [0.25, 0.25]
    assert rows[0]["action"] == [0.0, 0.0]  # it was shown, with velocities of zero


def test_statistics_are_those_of_all_frames(dataset):
    stats = json.loads((dataset / "meta/stats.json").read_text())
    rows = read(dataset / "data/chunk-000/file-000.parquet").to_pylist()
    states = np.array([row["observation.state"] for row in rows])
    np.testing.assert_allclose(stats["observation.state"]["mean"], states.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(stats["observation.state"]["std"], states.std(axis=0), atol=1e-6)
    assert stats["action"]["count"] == [20]


def test_pandas_finds_the_task_as_its_index(dataset):
    pandas = pytest.importorskip("pandas")
    tasks = pandas.read_parquet(dataset / "meta/tasks.parquet")
    assert tasks.loc["sweep"].task_index == 0
    assert list(tasks.columns) == ["task_index"]
