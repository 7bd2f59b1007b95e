"""A trial's bag that is empty, damaged or gone: set aside, told, and its iteration done again."""

from __future__ import annotations

import shutil
import sys

import numpy as np
import pytest
import toy_robot
from example_trajectories import torn_bag
from foreign_bags import motion, on_topic, write_rosbag2

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.bag_files import bag_number
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.inspect import inspect
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=8, options={"linear_phase.count": 3})


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run of three trials; tests copy it, and never write to it."""
    return toy_robot.record_run(tmp_path_factory.mktemp("lost"), SETTINGS, trials=3)


@pytest.fixture
def copy(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "copy")


@pytest.fixture
def reopen(copy):
    runs = []

    def again():
        while runs:
            runs.pop().close()
        runs.append(Apprenticeship.open(copy, None, toy_robot.ROBOT, SETTINGS))
        return runs[-1]

    yield again
    for run in runs:
        run.close()


def empty(bag):
    (bag / "003_0.mcap").write_bytes(b"")


def without_file(bag):
    (bag / "003_0.mcap").unlink()
    (bag / "metadata.yaml").unlink()


def flipped(bag):
    content = bytearray((bag / "003_0.mcap").read_bytes())
    content[len(content) // 3] ^= 1
    (bag / "003_0.mcap").write_bytes(content)


@pytest.mark.parametrize("spoil", [empty, without_file, flipped])
def test_an_unreadable_bag_is_set_aside_and_told_and_the_run_goes_on(copy, reopen, spoil):
    spoil(write_like(copy / "trials" / "003"))
    run = reopen()
    assert run.next_index == 3
    assert not (copy / "trials" / "003").exists()
    assert (copy / "trials" / "003.damaged").is_dir()
    (note,) = run.notes
    assert note.startswith("003 cannot be read, and is now called 003.damaged: ")
    plan = run.prepare()
    bag = toy_robot.record_trial(plan, run.directory.trials_directory)
    assert bag.name == "004"  # numbers are never used twice
    run.finish(bag)
    assert reopen().notes == ()
    assert ("trials/003.damaged" in inspect(copy)) == (spoil is not without_file)


def write_like(bag):
    """A trial's bag under this name, whole."""
    made = toy_robot.record_demonstration(bag.parent)
    assert made == bag
    return bag


def test_a_bag_without_a_whole_trial_stays_and_is_told(copy, reopen):
    torn_bag(copy / "trials")
    write_rosbag2(copy / "trials" / "007", on_topic(motion(joints=("knee",))))
    run = reopen()
    assert run.next_index == 3
    first, second = run.notes
    assert first.startswith("003 is passed over: ")
    assert second.startswith("007 is passed over: not recorded: ")
    assert (copy / "trials" / "003").is_dir()


@pytest.mark.parametrize("iteration", [0, 1, 2])
@pytest.mark.parametrize("how", ["flipped", "gone"])
def test_the_trial_of_a_judged_iteration_is_done_again_and_those_after_it_count_again(
    copy, reopen, iteration, how
):
    bag = copy / "trials" / f"{iteration:03d}"
    before = (copy / "metrics.csv").read_text()
    policies = {path.name: path.read_bytes() for path in copy.glob("policy_*.yaml")}
    if how == "gone":
        shutil.rmtree(bag)
    else:
        file = bag / f"{iteration:03d}_0.mcap"
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 8
        file.write_bytes(content)
    run = reopen()
    assert run.next_index == iteration
    assert f"the trial of iteration {iteration} is lost, and is to be done again" in run.notes[0]
    assert (copy / "metrics.withdrawn.1.csv").read_text() == before
    plan = run.prepare()
    assert plan.iteration.index == iteration
    again = toy_robot.record_trial(plan, run.directory.trials_directory)
    run.finish(again)
    assert run.next_index == 3
    rows = run.directory.metrics()
    assert [row.iteration for row in rows] == [0, 1, 2]
    assert rows[iteration].trial == bag_number(again)
    assert {path.name: path.read_bytes() for path in copy.glob("policy_*.yaml")} == policies
    run.prepare()
    assert reopen().next_index == 3


def test_a_run_is_reopened_by_reading_each_judged_trial_once(copy, reopen):
    """Nor are the policies of judged iterations read, whose trials are known."""
    opened = []
    watched = str(copy)

    def watch(event, arguments):
        if watched and event == "open" and str(arguments[0]).startswith(watched):
            opened.append(str(arguments[0]).removeprefix(watched))

    sys.addaudithook(watch)
    reopen()
    watched = ""
    for k in range(3):
        assert opened.count(f"/trials/00{k}/00{k}_0.mcap") == 1
        assert opened.count(f"/policy_00{k}.yaml") == 0
    assert opened.count("/config.yaml") <= 2


def test_what_is_learned_from_a_long_run_is_kept_and_its_bags_are_not_read_again(
    copy, reopen, monkeypatch
):
    before = read_rollouts(reopen())
    assert sorted(each.name for each in (copy / "rollouts").iterdir()) == [
        "000.npz",
        "001.npz",
        "002.npz",
    ]
    monkeypatch.setattr(RunDirectory, "read_path", unwanted)
    for left, right in zip(read_rollouts(reopen()), before, strict=True):
        np.testing.assert_array_equal(left.states, right.states)
        np.testing.assert_array_equal(left.controls, right.controls)


def unwanted(*_):
    raise AssertionError("a bag was read")


def read_rollouts(run):
    return run._loop.trials


@pytest.mark.parametrize("spoil", ["gone", "empty", "of another trial", "damaged"])
def test_what_is_kept_of_a_trial_is_made_anew_if_it_is_not_that_trial(copy, reopen, spoil):
    before = read_rollouts(reopen())
    kept = copy / "rollouts" / "001.npz"
    content = bytearray(kept.read_bytes())
    if spoil == "gone":
        kept.unlink()
    elif spoil == "empty":
        kept.write_bytes(b"")
    elif spoil == "of another trial":
        shutil.copy(copy / "rollouts" / "002.npz", kept)
    else:
        content[len(content) // 2] ^= 1
        kept.write_bytes(content)
    run = reopen()
    assert run.notes == ()
    np.testing.assert_array_equal(read_rollouts(run)[1].states, before[1].states)
    np.testing.assert_array_equal(np.load(kept)["states"], before[1].states)


def test_samples_are_what_they_were_after_all_this(copy, finished):
    for k in range(3):
        name = f"trials/{k:03d}"
        left, right = read_bag(copy / name), read_bag(finished / name)
        assert (left.positions == right.positions).all()
