from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from example_trajectories import JOINTS, assert_same, demonstration, torn_bag, trial

from irlpilco_ros.experience.bag_files import mark_discarded
from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.metrics import REPLAY, MetricsRow
from irlpilco_ros.experience.recovery import recover
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import LinearPolicy

CONFIGURATION = {"horizon": 16, "starts": ("last", "zero"), "velocity_limit": np.array([0.5, 1.5])}
SOURCES = Path(__file__).parents[2]


def policy(seed: int) -> LinearPolicy:
    random = np.random.default_rng(seed)
    weights, bias = random.normal(size=(3, 6)), random.normal(size=3)
    return LinearPolicy(weights, bias, np.array([0.5, 1.0, 1.5]))


def row(iteration: int | None, trial_number: int = 0) -> MetricsRow:
    path = (0.2, 0.3, 1.5, 4.0)
    return MetricsRow(iteration, trial_number, 0.1, 0.01, 1.0, 2.0, 8.0, 0.5, 0.25, *path)


@pytest.fixture
def shown(tmp_path) -> Path:
    return write_trajectory(tmp_path / "recordings", demonstration())


@pytest.fixture
def run(tmp_path, shown):
    with RunDirectory(tmp_path / "runs" / "sweep").claim(CONFIGURATION, shown) as claimed:
        yield claimed


def test_a_new_run_has_its_configuration_and_a_copy_of_the_demonstration(run, shown):
    assert run.configuration() == {
        "horizon": 16,
        "starts": ["last", "zero"],
        "velocity_limit": [0.5, 1.5],
    }
    assert_same(run.demonstrations()[0], demonstration())
    assert (run.demonstration_directory / "metadata.yaml").exists()
    assert run.iterations() == ()
    assert run.metrics() == ()
    assert run.search_trials(Joints(JOINTS), lambda _: 16).trials == {}


def test_the_same_again_goes_on(run, shown):
    run.release()
    leftover = run.path / ".metrics.csv.4711.tmp"  # of a process that was killed while writing
    leftover.write_text("half a fi")
    moved = shown.rename(shown.with_name("042"))  # the same messages under another name
    with (
        run.claim(dict(CONFIGURATION), moved),
        run.claim(CONFIGURATION, run.demonstration_directory),
    ):
        assert not leftover.exists()


def test_a_demonstration_may_be_given_as_a_file(tmp_path, shown):
    with RunDirectory(tmp_path / "run").claim({}, shown / "000_0.mcap") as claimed:
        assert_same(claimed.demonstrations()[0], demonstration())


def test_several_demonstrations_are_a_folder_of_bags(tmp_path):
    folder = tmp_path / "recordings"
    bags = [write_trajectory(folder, demonstration(seed=seed)) for seed in range(3)]
    mark_discarded(bags[1])
    path = tmp_path / "run"
    with RunDirectory(path).claim({}, folder) as claimed:
        for shown, seed in zip(claimed.demonstrations(), (0, 2), strict=True):
            assert_same(shown, demonstration(seed=seed))
    with RunDirectory(path).claim({}, folder):
        pass
    write_trajectory(folder, demonstration(seed=3))
    with pytest.raises(RunDirectoryError, match="was begun with another demonstration"):
        RunDirectory(path).claim({}, folder)


def test_another_configuration_is_refused_key_by_key(run, shown):
    other = {"horizon": 12, "starts": ["last", "zero"], "seed": 5, "evaluations": 12}
    with pytest.raises(RunDirectoryError) as refused:
        RunDirectory(run.path).claim(other, shown)
    assert "in use" in str(refused.value)
    run.release()
    with pytest.raises(RunDirectoryError) as refused:
        RunDirectory(run.path).claim(other, shown)
    message = str(refused.value)
    assert "horizon was 16, now 12" in message
    assert "seed was 0, now 5" in message  # a setting that is new had its default
    assert "velocity_limit was [0.5, 1.5], now not there" in message
    assert "starts" not in message
    assert "evaluations" not in message
    with run.claim(CONFIGURATION, shown):  # a refused claim does not keep the lock
        pass


def test_another_demonstration_is_refused(run, tmp_path):
    run.release()
    other = write_trajectory(tmp_path / "recordings", demonstration(seed=1))
    with pytest.raises(RunDirectoryError, match="was begun with another demonstration"):
        run.claim(CONFIGURATION, other)


def test_a_folder_with_trials_of_nobody_is_refused(tmp_path, shown):
    write_trajectory(tmp_path / "run" / "trials", trial())
    with pytest.raises(RunDirectoryError, match="holds trials but no config"):
        RunDirectory(tmp_path / "run").claim(CONFIGURATION, shown)


def test_a_missing_demonstration_leaves_no_folder(tmp_path):
    with pytest.raises(BagError, match="is not there; expected a folder"):
        RunDirectory(tmp_path / "run").claim(CONFIGURATION, tmp_path / "nothing")
    assert not (tmp_path / "run").exists()
    with pytest.raises(RunDirectoryError, match="is no run directory"):
        RunDirectory(tmp_path / "run").configuration()


def test_two_learners_cannot_share_a_run_and_a_killed_one_does_not_keep_it(run, shown):
    run.release()
    script = (
        "import sys, time; from pathlib import Path\n"
        "from irlpilco_ros.experience.run_directory import RunDirectory\n"
        "configuration = dict(horizon=16, starts=['last', 'zero'], velocity_limit=[0.5, 1.5])\n"
        "run = RunDirectory(sys.argv[1]).claim(configuration, Path(sys.argv[2]))\n"
        "print('claimed', flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, str(run.path), str(shown)],
        stdout=subprocess.PIPE,
        cwd=SOURCES,
        start_new_session=True,
    ) as other:
        assert other.stdout.readline() == b"claimed\n"
        with pytest.raises(RunDirectoryError, match=rf"another learner \(process {other.pid}\)"):
            run.claim(CONFIGURATION, shown)
        os.killpg(other.pid, signal.SIGKILL)
    with run.claim(CONFIGURATION, shown):
        pass


def test_reading_needs_no_claim_but_writing_does(run):
    reader = RunDirectory(run.path)
    assert reader.metrics() == ()
    for write in (
        lambda: reader.append_metrics(row(0)),
        lambda: reader.write_policy(0, policy(0), Joints(JOINTS)),
    ):
        with pytest.raises(RunDirectoryError, match="open for reading only; claim it first"):
            write()


def test_trials_are_found_by_what_the_robot_did(run):
    for k in (0, 1, 2):
        run.write_policy(k, policy(k), Joints(JOINTS))
    trials = run.trials_directory
    write_trajectory(trials, trial(policy=policy(0), seed=10))  # 000
    write_trajectory(trials, trial(steps=9, policy=policy(1), seed=11))  # 001: stopped early
    torn = torn_bag(trials)  # 002
    mark_discarded(write_trajectory(trials, trial(policy=policy(2), seed=12)))  # 003
    recover(torn)
    (trials / "004").mkdir()  # killed before the first byte
    write_trajectory(trials, trial(policy=policy(1), seed=13))  # 005
    write_trajectory(trials, trial(seed=14))  # 006: nobody's
    found = run.search_trials(Joints(JOINTS), lambda _: 16).trials
    assert {k: each.number for k, each in found.items()} == {0: 0, 1: 5}
    assert found[1].path == trials / "005"
    np.testing.assert_array_equal(
        found[1].rollout.states, trial(policy=policy(1), seed=13).rollout(Joints(JOINTS)).states
    )


def test_equal_policies_of_two_iterations_take_one_trial_each(run):
    for k in (0, 1):
        run.write_policy(k, policy(7), Joints(JOINTS))
    for seed in (1, 2, 3):
        write_trajectory(run.trials_directory, trial(policy=policy(7), seed=seed))
    found = run.search_trials(Joints(JOINTS), lambda _: 16).trials
    assert {k: each.number for k, each in found.items()} == {0: 0, 1: 1}


def test_a_command_that_is_off_by_a_little_is_another_policys(run):
    run.write_policy(0, policy(0), Joints(JOINTS))
    nearly = policy(0).with_parameters(policy(0).parameters + 1e-7)
    write_trajectory(run.trials_directory, trial(policy=nearly))
    assert run.search_trials(Joints(JOINTS), lambda _: 16).trials == {}


def test_an_iteration_comes_back_with_its_policy(run):
    random = np.random.default_rng(2)
    learned = Iteration(
        index=1,
        policy=policy(1),
        hyperparameters=Hyperparameters(
            random.normal(size=(6, 9)), random.normal(size=6), random.normal(size=6)
        ),
        weights=random.uniform(size=3),
        margin=0.25,
        cost=1 / 3,
        predicted_means=random.normal(size=(17, 6)),
        predicted_covariances=random.normal(size=(17, 6, 6)),
        evaluations=40,
        model_seconds=1.5,
        policy_seconds=2.5,
        notes=("a jitter of 1e-9 was added",),
    )
    run.write_iteration(learned, Joints(JOINTS), {"start_position": [0.0, 0.1, 0.2]})
    assert run.iterations() == (1,)
    again = RunDirectory(run.path).read_iteration(1)
    for name, value in learned.to_arrays().items():
        np.testing.assert_array_equal(again.to_arrays()[name], value, err_msg=name)
    np.testing.assert_array_equal(run.read_policy(1).weights, policy(1).weights)
    text = run.policy_file(1).read_text()
    assert "params-file policy_001.yaml" in text
    assert "start_position: [0.0, 0.1, 0.2]" in text
    with np.load(run.iteration_file(1), allow_pickle=False) as arrays:
        assert float(arrays["cost"]) == 1 / 3
    run.append_metrics(row(1))
    with pytest.raises(RunDirectoryError, match=r"iteration 1 of .* is over"):
        run.write_iteration(learned, Joints(JOINTS))


def test_a_judged_iteration_is_never_written_again(run):
    run.write_policy(0, policy(0), Joints(JOINTS))
    run.write_policy(0, policy(1), Joints(JOINTS))  # its trial has not been judged: it may change
    run.append_metrics(row(0))
    run.append_metrics(row(None, 3))
    with pytest.raises(RunDirectoryError, match=r"iteration 0 of .* is over"):
        run.write_policy(0, policy(2), Joints(JOINTS))
    np.testing.assert_array_equal(run.read_policy(0).weights, policy(1).weights)
    assert [each.iteration for each in run.metrics()] == [0]
    assert run.baseline_metrics(REPLAY) == row(None, 3)


def test_an_unreadable_iteration_is_named_and_half_of_one_does_not_count(run):
    run.iteration_file(1).write_bytes(b"PK\x03\x04 torn")
    assert run.iterations() == ()  # its policy was never written
    run.write_policy(1, policy(1), Joints(JOINTS))
    assert run.iterations() == (1,)
    with pytest.raises(RunDirectoryError, match=r"cannot read the iteration .*001\.npz"):
        run.read_iteration(1)


def test_a_killed_writer_leaves_the_old_file_or_the_new_one(tmp_path):
    """Kill -9 a process that writes the same file over and over, at some moment."""
    path = tmp_path / "file"
    script = (
        "import sys; from pathlib import Path\n"
        "from irlpilco_ros.experience.durable import write_atomically\n"
        "for k in range(10**9): write_atomically(Path(sys.argv[1]), (b'%d ' % k) * 50_000)\n"
    )
    for delay in (0.05, 0.1):
        with subprocess.Popen(
            [sys.executable, "-c", script, str(path)], cwd=SOURCES, start_new_session=True
        ) as writer:
            deadline = time.monotonic() + 20.0
            while not path.exists() and time.monotonic() < deadline:
                time.sleep(0.01)
            time.sleep(delay)
            os.killpg(writer.pid, signal.SIGKILL)
        words = path.read_bytes().split()
        assert len(words) == 50_000
        assert len(set(words)) == 1
    write_atomically(path, b"new")
    assert path.read_bytes() == b"new"
