"""The run knows which of its policies is the best: by its rows, in best_policy.yaml, in words."""

from __future__ import annotations

import math
import os
import shutil

import numpy as np
import pytest
import toy_robot

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.best_trial import best_command, best_row, best_sentence
from irlpilco_ros.experience.inspect import inspect
from irlpilco_ros.experience.metrics import MetricsRow
from irlpilco_ros.experience.policy_file import read_policy_file
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=6, options={"linear_phase.count": 3})
BEST = 1


def row(iteration, mse, trial=0):
    return MetricsRow(iteration, trial, math.sqrt(mse), mse, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("errors", "best"),
    [([0.3], 0), ([0.3, 0.1, 0.2], 1), ([0.3, 0.1, 0.1], 1), ([math.nan, 0.2], 1), ([], None)],
)
def test_the_best_row_has_the_least_error_and_is_the_first_of_its_like(errors, best):
    rows = [row(None, 1e-9), *(row(k, error) for k, error in enumerate(errors))]
    found = best_row(rows)
    assert (found and found.iteration) == best


def take_trial(run, offset):
    """The next trial, which starts this far from where it should [rad]."""
    plan = run.prepare()
    start = np.array(plan.parameters["start_position"]) + offset
    trial = toy_robot.trial_of(plan.iteration.policy, start, seed=plan.iteration.index)
    return run.finish(write_trajectory(run.directory.trials_directory, trial))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Four trials, of which the second is the best."""
    folder = tmp_path_factory.mktemp("best")
    shown = toy_robot.record_demonstration(folder / "shown")
    run = Apprenticeship.open(folder / "run", shown, toy_robot.ROBOT, SETTINGS)
    reports = [take_trial(run, offset) for offset in (0.5, 0.0, 0.4, 0.6)]
    run.close()
    return RunDirectory(folder / "run"), reports


@pytest.fixture
def copy(finished, tmp_path):
    return RunDirectory(shutil.copytree(finished[0].path, tmp_path / "copy"))


def reopen(run):
    opened = Apprenticeship.open(run.path, None, toy_robot.ROBOT, SETTINGS)
    opened.close()
    return opened


def test_best_policy_is_a_copy_of_the_policy_file_that_says_which(finished):
    run, _ = finished
    head, content = run.best_policy_file.read_text().split("\n", 1)
    assert content == run.policy_file(BEST).read_text()
    error = run.metrics()[BEST].rmse_rad
    assert head == f"# iteration 1, trial 001, {error:.4f} rad off at the decisions"
    policy, _ = read_policy_file(run.best_policy_file)
    np.testing.assert_array_equal(policy.parameters, run.read_iteration(BEST).policy.parameters)


def test_whoever_learned_something_worse_is_told_what_is_best(finished):
    _, reports = finished
    best = f"the best so far is iteration 1: {reports[BEST].row.rmse_rad:.4f} rad off"
    assert [best in report.sentence() for report in reports] == [False, False, True, True]


@pytest.mark.parametrize("left", [None, b"", b"# iteration 0, trial 000\nolder", b"\xff" * 99])
def test_a_learner_killed_before_the_copy_makes_it_when_it_is_started_again(copy, finished, left):
    copy.best_policy_file.unlink()
    if left is not None:
        copy.best_policy_file.write_bytes(left)
    assert reopen(copy).notes == ()
    assert copy.best_policy_file.read_bytes() == finished[0].best_policy_file.read_bytes()


def test_a_copy_that_is_up_to_date_is_not_written_again(copy):
    before = os.stat(copy.best_policy_file).st_ino
    reopen(copy)
    assert os.stat(copy.best_policy_file).st_ino == before


def test_a_search_that_goes_astray_would_start_from_the_best_again_after_a_restart(copy):
    best = reopen(copy)._loop.best
    assert best.index == BEST
    np.testing.assert_array_equal(
        best.policy.parameters, copy.read_iteration(BEST).policy.parameters
    )


@pytest.mark.parametrize("name", ["policy_001.yaml", "iterations/001.npz"])
def test_a_best_policy_that_cannot_be_read_is_told_and_keeps_nobody_from_learning(copy, name):
    (copy.path / name).write_bytes(b"\xff")
    copy.best_policy_file.unlink()
    run = Apprenticeship.open(copy.path, None, toy_robot.ROBOT, SETTINGS)
    (note,) = run.notes
    assert name in note
    take_trial(run, 0.3)
    run.close()


def test_inspect_tells_the_best_and_the_command_that_runs_it(finished, copy):
    run, _ = finished
    error = run.metrics()[BEST].rmse_rad
    command = f"ros2 run irlpilco_ros controller --ros-args --params-file {run.best_policy_file}"
    line = f"best: iteration 1, trial 001, {error:.4f} rad off at the decisions; run it: {command}"
    assert line in inspect(run.path).splitlines()
    copy.best_policy_file.unlink()  # a run of before
    assert best_command(copy).endswith(f"--params-file {copy.policy_file(1)}")
    copy.metrics_file.write_text("nonsense")
    assert "best: not known: " in inspect(copy.path)
    assert "best: " not in inspect(copy.trials_directory)


def test_a_path_with_a_space_is_quoted(copy, tmp_path):
    moved = RunDirectory(copy.path.rename(tmp_path / "my run"))
    assert best_sentence(moved).endswith(f"'{moved.best_policy_file}'")


def test_before_the_first_trial_nothing_is_the_best(tmp_path):
    run = RunDirectory(tmp_path)
    assert best_command(run) == ""
    assert best_sentence(run) == "best: no trial has been judged yet"
