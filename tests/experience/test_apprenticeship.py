"""Algorithm 3 on a run directory: order, resuming at every point, refusals, and the replay."""

from __future__ import annotations

import dataclasses
import math
import shutil

import numpy as np
import pytest
import toy_robot
import yaml

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.errors import IncompleteTrialError, RunDirectoryError
from irlpilco_ros.experience.metrics import REPLAY
from irlpilco_ros.experience.policy_file import policy_from_parameters, read_policy_file
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=8, options={"linear_phase.count": 3})


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory):
    return toy_robot.record_demonstration(tmp_path_factory.mktemp("demonstration"))


@pytest.fixture(scope="module")
def finished(tmp_path_factory, demonstration):
    """A run of three trials; tests copy it, and never write to it."""
    path = tmp_path_factory.mktemp("runs") / "finished"
    run = Apprenticeship.open(path, demonstration, toy_robot.ROBOT, SETTINGS)
    for _ in range(3):
        plan = run.prepare()
        run.finish(toy_robot.record_trial(plan, run.directory.trials_directory))
    run.close()
    return path


@pytest.fixture
def copy(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "copy")


@pytest.fixture
def reopen():
    runs = []

    def again(path, demonstration=None, robot=toy_robot.ROBOT, settings=SETTINGS):
        while runs:
            runs.pop().close()
        runs.append(Apprenticeship.open(path, demonstration, robot, settings))
        return runs[-1]

    yield again
    for run in runs:
        run.close()


def drop_rows(path, keep):
    """Leave the first rows of metrics.csv, as if the learner had been killed before the others."""
    lines = (path / "metrics.csv").read_text().splitlines(keepends=True)
    (path / "metrics.csv").write_text("".join(lines[: 1 + keep]))


def test_every_trial_gets_its_row_and_learning_helps(finished, reopen, tmp_path):
    rows = reopen(shutil.copytree(finished, tmp_path / "rows")).directory.metrics()
    assert [(row.iteration, row.trial) for row in rows] == [(0, 0), (1, 1), (2, 2)]
    assert [row.robot_time_s for row in rows] == [3.0, 6.0, 9.0]
    assert rows[2].rmse_rad < rows[0].rmse_rad / 3
    assert rows[0].margin >= rows[1].margin >= rows[2].margin
    assert math.isnan(rows[0].cost)
    assert rows[1].cost > 0.0
    assert all(row.mse == pytest.approx(row.rmse_rad**2) for row in rows)


def test_several_demonstrations_are_imitated_on_average(tmp_path):
    bags = [toy_robot.record_demonstration(tmp_path / "shown", seed) for seed in range(3)]
    settings = dataclasses.replace(SETTINGS, imitation="trajectory_kl")
    run = Apprenticeship.open(tmp_path / "run", tmp_path / "shown", toy_robot.ROBOT, settings)
    states = [shown.states for shown in run.task.demonstrations]
    assert len(states) == len(bags)
    np.testing.assert_array_equal(run.task.reference_states(), np.mean(states, axis=0))
    for _ in range(2):
        plan = run.prepare()
        run.finish(toy_robot.record_trial(plan, run.directory.trials_directory))
    first, second = run.directory.metrics()
    assert second.rmse_rad < first.rmse_rad / 2
    run.close()


def test_the_policy_file_holds_what_the_controller_gets(copy, reopen):
    run = reopen(copy)
    plan = run.prepare()
    policy, joints = read_policy_file(run.directory.policy_file(3))
    assert joints.names == toy_robot.JOINTS
    handed_over, _ = policy_from_parameters(plan.parameters)
    np.testing.assert_array_equal(policy.parameters, plan.iteration.policy.parameters)
    np.testing.assert_array_equal(handed_over.parameters, plan.iteration.policy.parameters)
    assert len(plan.parameters["start_position"]) == 2


def test_a_learner_killed_while_learning_finds_the_same_again(copy, reopen):
    drop_rows(copy, 2)
    shutil.rmtree(copy / "trials" / "002")
    before = (copy / "policy_002.yaml").read_bytes()
    (copy / "policy_002.yaml").unlink()
    (copy / "iterations" / "002.npz").unlink()
    run = reopen(copy)
    assert run.next_index == 2
    run.prepare()
    assert (copy / "policy_002.yaml").read_bytes() == before


def test_what_was_learned_before_the_trial_is_not_learned_again(copy, reopen):
    drop_rows(copy, 2)
    shutil.rmtree(copy / "trials" / "002")
    run = reopen(copy)

    def never(_):
        raise AssertionError("it learned again")

    assert run.prepare(never).iteration.index == 2


def test_a_trial_recorded_before_the_kill_is_judged_on_the_way_in(copy, finished, reopen):
    drop_rows(copy, 2)
    assert reopen(copy).next_index == 3
    assert (copy / "metrics.csv").read_text() == (finished / "metrics.csv").read_text()


def test_a_broken_off_trial_is_kept_and_the_trial_done_again(copy, reopen):
    run = reopen(copy)
    plan = run.prepare()
    torn = toy_robot.record_trial(plan, run.directory.trials_directory, steps=4)
    with pytest.raises(IncompleteTrialError):
        run.finish(torn)
    run = reopen(copy)
    assert run.next_index == 3
    plan = run.prepare()
    report = run.finish(toy_robot.record_trial(plan, run.directory.trials_directory))
    assert report.row.trial == 4
    assert torn.exists()
    assert run.prepare().iteration.index == 4


def test_cancelled_learning_leaves_nothing_behind(copy, reopen):
    run = reopen(copy)
    before = sorted(path.name for path in copy.rglob("*"))

    class StopError(Exception):
        pass

    def stop(_):
        raise StopError

    with pytest.raises(StopError):
        run.prepare(stop)
    assert sorted(path.name for path in copy.rglob("*")) == before


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("linear_phase.count", {"options": {"linear_phase.count": 4}}),
        ("seed", {"seed": 1}),
        ("optimiser", {"optimiser": "lbfgs"}),
    ],
)
def test_another_configuration_is_refused_by_name(copy, reopen, name, change):
    with pytest.raises(RunDirectoryError, match=name):
        reopen(copy, settings=dataclasses.replace(SETTINGS, **change))


def test_a_run_with_names_of_before_goes_on(copy, reopen):
    policies = [f"policy_{number:03d}.yaml" for number in range(3)]
    for name, new, old in [
        ("config.yaml", "linear_phase.count", "phase_count"),
        ("config.yaml", "rbf.count", "rbf_count"),
        ("config.yaml", "feature_matching.variance_weight", "variance_weight"),
        ("config.yaml", "imitation", "method"),
        ("config.yaml", "screening_evaluations", "race"),
        *((name, "control_limit", "velocity_limit") for name in policies),
    ]:
        text = (copy / name).read_text()
        assert f"{new}:" in text
        (copy / name).write_text(text.replace(f"{new}:", f"{old}:"))
    drop_rows(copy, 1)  # trials that have to be recognised by their policies
    assert reopen(copy).next_index == 3


def test_a_run_that_was_begun_before_there_were_some_settings_goes_on(copy, reopen):
    file = copy / "config.yaml"
    before = yaml.safe_load(file.read_text())
    newer = ("acceleration_limit", "command_history", "model_points", "sensor_noise")
    file.write_text(yaml.safe_dump({k: v for k, v in before.items() if k not in newer}))
    assert reopen(copy).next_index == 3
    changed = dataclasses.replace(SETTINGS, model_points=200)
    with pytest.raises(RunDirectoryError, match="model_points was 300, now 200"):
        reopen(copy, settings=changed)


def test_the_number_of_threads_is_no_configuration(copy, reopen):
    assert reopen(copy, settings=dataclasses.replace(SETTINGS, threads=1)).next_index == 3


def test_another_demonstration_is_refused(copy, reopen, finished):
    with pytest.raises(RunDirectoryError, match="another demonstration"):
        reopen(copy, demonstration=finished / "trials" / "000")


def test_no_demonstration_at_all(tmp_path, reopen):
    with pytest.raises(RunDirectoryError, match="has no demonstration yet; set the learner"):
        reopen(tmp_path / "new")
    with pytest.raises(RunDirectoryError, match="missing is not there"):
        reopen(tmp_path / "new", demonstration=tmp_path / "missing")


def test_the_replay_has_a_row_of_its_own(tmp_path, demonstration, reopen):
    run = reopen(tmp_path / "run", demonstration)
    policy, _ = policy_from_parameters(run.replay_parameters())
    start = run.replay_parameters()["start_position"]
    trial = toy_robot.trial_of(policy, start, seed=5)
    bag = write_trajectory(run.directory.replay_directory, trial)
    row = run.finish_replay(bag)
    assert repr(row) == repr(run.directory.baseline_metrics(REPLAY))  # NaN equals nothing
    assert 0.02 < row.rmse_rad < 0.2
    assert run.next_index == 0
