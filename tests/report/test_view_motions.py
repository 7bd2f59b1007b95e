"""What `irlpilco view` shows of a run and of a bag."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from report_runs import LATE, PREDICTED_LATE, demonstrated, write_run

from irlpilco_ros.cli import main
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.view.motions import motions_of_bag, motions_of_run

JOINTS = ("shoulder", "elbow")
POSITIONS = demonstrated(2, 4)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "demo", JOINTS, POSITIONS)


def test_every_trial_can_be_chosen_and_the_best_is_first(run):
    motions = motions_of_run(run.path)
    assert [entry.name for entry in motions.entries] == [
        "replay", "first trial", "iteration 1", "iteration 2",
    ]  # fmt: skip
    assert motions.entries[motions.first].name == "first trial"  # each later one is worse here
    assert motions.joints == JOINTS
    assert motions.places == ("as shown",)


def test_a_trial_is_shown_beside_demonstration_and_band(run):
    motions = motions_of_run(run.path)
    course = motions.entries[3].read()
    np.testing.assert_allclose(course.times, [0.0, 0.5, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(course.error, 3.0 * LATE, atol=1e-9)
    np.testing.assert_allclose(course.band_times, course.times)
    np.testing.assert_allclose(course.band[0], POSITIONS + 2.0 * PREDICTED_LATE, atol=1e-9)
    np.testing.assert_allclose(course.band[1], 2e-3)
    assert motions.entries[1].read().band_times.size == 0
    assert motions.entries[3].read() is course


def test_a_recording_with_every_state_is_shown_with_all_of_them(repository):
    motions = motions_of_bag(repository / "bags/sweep/trials/001")
    course = motions.entries[0].read()
    assert len(motions.joints) == 14
    assert len(course.times) > 700
    assert course.times[0] == 0.0
    assert course.wanted is None
    assert not course.error.any()


def test_what_there_is_nothing_to_see_of_is_refused(tmp_path, run):
    with pytest.raises(BagError):
        motions_of_bag(tmp_path)
    empty = RunDirectory(tmp_path / "empty")
    bag = run.path.parent / f"{run.path.name}_shown" / "000"
    with empty.claim({"joints": JOINTS, "horizon": 4, "control_period": 0.5, "seed": 0}, bag):
        pass
    with pytest.raises(RunDirectoryError, match="no judged trial"):
        motions_of_run(empty.path)


def test_without_viser_it_says_what_to_install(run, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["view", str(run.path), "--no-browser"]) == 1
    error = capsys.readouterr().err
    assert "pip install viser" in error
    assert error.count("\n") == 1
