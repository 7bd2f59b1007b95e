"""An old run is kept under the next free number, and what is no run is left alone."""

from __future__ import annotations

import pytest

from irlpilco_ros.cli import main
from irlpilco_ros.commands.run_folder import keep_previous
from irlpilco_ros.experience.errors import RunDirectoryError

CONFIGURATION = "joints: [a]\nhorizon: 4\nimitation: feature_matching\n"


def test_nothing_to_keep(tmp_path):
    assert keep_previous(tmp_path / "demo") is None
    assert not (tmp_path / "demo").exists()


def test_an_empty_folder_is_taken_as_it_is(tmp_path):
    assert keep_previous(tmp_path) is None
    assert tmp_path.is_dir()


def test_runs_are_kept_one_after_the_other(tmp_path):
    for number in range(1, 4):
        (tmp_path / "demo").mkdir()
        (tmp_path / "demo" / "config.yaml").write_text(CONFIGURATION)
        (tmp_path / "demo" / "notes.txt").write_text(str(number))
        assert keep_previous(tmp_path / "demo") == tmp_path / f"demo.{number}"
    kept = {path.name: (path / "notes.txt").read_text() for path in tmp_path.iterdir()}
    assert kept == {"demo.1": "1", "demo.2": "2", "demo.3": "3"}


def test_a_demo_that_ended_before_the_demonstration_is_kept_too(tmp_path):
    (tmp_path / "demo" / "log").mkdir(parents=True)
    (tmp_path / "demo" / "log" / "learner.log").touch()
    assert keep_previous(tmp_path / "demo") == tmp_path / "demo.1"


@pytest.mark.parametrize("kind", ["other work", "another config.yaml", "plain file", "logs"])
def test_what_is_no_run_stays_where_it_is(tmp_path, kind, capsys):
    path = tmp_path / "mine"
    if kind == "plain file":
        path.write_text("mine")
    else:
        path.mkdir()
        (
            path / {"another config.yaml": "config.yaml", "logs": "log"}.get(kind, "thesis.tex")
        ).touch()
    before = sorted(tmp_path.rglob("*"))
    assert main(["demo", "--run-directory", str(path)]) == 1
    assert "mine is there and is no run: it stays as it is" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_the_current_folder_is_not_moved(tmp_path, monkeypatch):
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "config.yaml").write_text(CONFIGURATION)
    monkeypatch.chdir(tmp_path / "demo")
    for name in (".", str(tmp_path / "demo"), ".."):
        with pytest.raises(RunDirectoryError, match="the current folder is in"):
            keep_previous((tmp_path / "demo" / name).absolute())
    assert (tmp_path / "demo").is_dir()
