"""`irlpilco plot` draws the joints of bags on top of each other."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.cli import main
from irlpilco_ros.experience.episodes import Episode
from irlpilco_ros.report.bag_figure import bag_figure


def episode(name, joints):
    times = np.linspace(0.0, 1.0, 11)
    positions = np.stack([k + times for k in range(len(joints))], axis=1)
    nothing = np.full_like(positions, np.nan)
    return Episode(name, joints, times, positions, np.ones_like(positions), nothing)


def test_each_joint_has_a_panel_with_every_recording_that_tells_of_it():
    figure = bag_figure([episode("one", ("a", "b")), episode("two", ("b", "c"))], ["a", "b", "c"])
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title("left") for axes in panels] == ["a", "b", "c"]
    assert [len(axes.lines) for axes in panels] == [1, 2, 1]
    drawn = [np.asarray(line.get_ydata(), dtype=float) for line in panels[1].lines]
    np.testing.assert_allclose(drawn[0], 1.0 + np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(drawn[1], np.linspace(0.0, 1.0, 11))


def test_it_writes_a_picture_and_nothing_over_another(repository, tmp_path, capsys):
    bags = [str(repository / "bags/sweep" / bag) for bag in ("demonstration", "trials/001")]
    out = tmp_path / "joints.svg"
    assert main(["plot", *bags, "--joints", "left_w?", "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}: 3 joints of 2 recordings\n"
    text = out.read_text()
    assert "<svg" in text
    assert main(["plot", *bags, "--out", str(out)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert out.read_text() == text


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--out", "a.xyz"], "cannot be drawn"),
        (["--out", "a.png", "--joints", "knee"], "no joint is called knee; recorded are left_s0"),
    ],
)
def test_what_cannot_be_drawn_is_said(repository, tmp_path, monkeypatch, capsys, words, reason):
    bag = str(repository / "bags/sweep/demonstration")
    monkeypatch.chdir(tmp_path)
    assert main(["plot", bag, *words]) == 1
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
