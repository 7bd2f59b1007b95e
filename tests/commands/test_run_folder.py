"""An old run is kept under the next free number."""

from __future__ import annotations

from irlpilco_ros.commands.run_folder import keep_previous


def test_nothing_to_keep(tmp_path):
    assert keep_previous(tmp_path / "demo") is None
    assert not (tmp_path / "demo").exists()


def test_runs_are_kept_one_after_the_other(tmp_path):
    for number in range(1, 4):
        (tmp_path / "demo").mkdir()
        (tmp_path / "demo" / "metrics.csv").write_text(str(number))
        assert keep_previous(tmp_path / "demo") == tmp_path / f"demo.{number}"
    kept = {path.name: (path / "metrics.csv").read_text() for path in tmp_path.iterdir()}
    assert kept == {"demo.1": "1", "demo.2": "2", "demo.3": "3"}
