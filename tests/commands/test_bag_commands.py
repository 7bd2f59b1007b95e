"""`irlpilco inspect` and `irlpilco recover`: a page or a line, never a traceback."""

from __future__ import annotations

import os

import pytest
import toy_robot

from irlpilco_ros.cli import main


@pytest.fixture
def bag(tmp_path):
    return toy_robot.record_demonstration(tmp_path / "bags")


def test_inspect_shows_a_bag_and_lists_a_folder_of_them(bag, capsys):
    assert main(["inspect", str(bag)]) == 0
    assert "demonstration of 6 control periods" in capsys.readouterr().out
    toy_robot.record_demonstration(bag.parent)
    (bag.parent / "002").mkdir()
    (bag.parent / "002" / "002_0.mcap").touch()
    assert main(["inspect", str(bag.parent)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{bag.parent}: 3 bags"
    assert [line.split()[0] for line in lines[1:]] == ["000", "001", "002"]
    assert "demonstration of 6 control periods" in lines[1]
    assert "holds no messages" in lines[3]


def test_recover_says_what_it_found_and_where_the_new_bag_is(bag, capsys):
    (bag / "metadata.yaml").unlink()
    assert main(["recover", str(bag)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "found: it has no metadata.yaml; all else was whole, and is copied as it was",
        f"recovered: {bag}.recovered, 7 messages",
    ]


@pytest.mark.parametrize("command", ["inspect", "recover"])
def test_what_is_no_bag_is_refused_in_a_line(tmp_path, bag, command, capsys):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "empty").mkdir()
    os.mkfifo(tmp_path / "fifo.mcap")
    for path in ("nothing", "file", "file/000", "empty", "fifo.mcap", "x" * 300, "bags/000/none"):
        assert main([command, str(tmp_path / path)]) == 1
        error = capsys.readouterr().err
        assert error.startswith("irlpilco: ")
        assert len(error.splitlines()) == 1, error
