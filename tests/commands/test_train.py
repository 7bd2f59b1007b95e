"""`irlpilco train`: the learner's results from bags, without ROS."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys

import pytest
import toy_robot

from irlpilco_ros.cli import main
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.bag_message import BagTopic
from irlpilco_ros.experience.bag_reader import read_messages
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=6, options={"linear_phase.count": 3})
SETTINGS_FILE = "/**:\n  ros__parameters:\n    evaluations: 6\n    linear_phase.count: 3\n"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    (folder / "robot.yaml").write_text(toy_robot.ROBOT_FILE)
    (folder / "settings.yaml").write_text(SETTINGS_FILE)
    return ["--robot", str(folder / "robot.yaml"), "--settings", str(folder / "settings.yaml")]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A run as the learner leaves it: two judged trials, and the third policy ready."""
    return toy_robot.record_run(tmp_path_factory.mktemp("recorded"), SETTINGS, 2, planned=True)


def train(recorded, out, files, trials=None):
    words = ["train", "--demonstration", str(recorded / "demonstration")]
    words += ["--trials", str(trials or recorded / "trials"), "--run-directory", str(out), *files]
    return main(words)


def test_it_finds_what_the_learner_found(recorded, files, tmp_path, capsys):
    assert train(recorded, tmp_path / "out", files) == 0
    for name in ("policy_000.yaml", "policy_001.yaml", "policy_002.yaml", "config.yaml"):
        assert (tmp_path / "out" / name).read_bytes() == (recorded / name).read_bytes()
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:2] == ["iteration", "trial"]
    assert [line.split()[:2] for line in lines[1:3]] == [["0", "0"], ["1", "1"]]
    assert lines[-2].startswith("best: iteration 1, trial 001, ")
    assert lines[-1].endswith("out/policy_002.yaml")


def test_an_iteration_that_predicts_much_worse_says_so(
    recorded, files, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("irlpilco_ros.learning.second_search.MUCH_WORSE", 1e-9)
    assert train(recorded, tmp_path / "out", files) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if "predicted cost" in line]
    (note,) = notes  # the first iteration has none to compare with
    assert note.startswith("iteration 2: the predicted cost ")
    assert "searched again from the policy of iteration 1" in note


def test_a_policy_slower_than_its_demonstration_is_told_of(recorded, files, tmp_path, capsys):
    robot = tmp_path / "robot.yaml"
    robot.write_text(
        toy_robot.ROBOT_FILE.replace("velocity_limit: [1.0,", "velocity_limit: [0.33,")
    )
    assert train(recorded, tmp_path / "out", ["--robot", str(robot), *files[2:]]) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if "slower than" in line]
    assert [note.split(":")[0] for note in notes] == ["iteration 0", "iteration 1", "iteration 2"]
    assert "shoulder at 0.35 rad/s, where it may go 0.33; it stays behind there" in notes[-1]


def test_a_learner_can_go_on_with_the_result(recorded, files, tmp_path):
    train(recorded, tmp_path / "out", files)
    run = Apprenticeship.open(tmp_path / "out", None, toy_robot.ROBOT, SETTINGS)
    assert run.next_index == 2
    run.close()


def test_broken_off_trials_are_passed_over(recorded, files, tmp_path, capsys):
    run = Apprenticeship.open(recorded, None, toy_robot.ROBOT, SETTINGS)
    toy_robot.record_trial(run.prepare(), tmp_path / "trials", steps=3)
    run.close()
    assert train(recorded, tmp_path / "out", files, trials=tmp_path / "trials") == 1
    assert "no whole trial" in capsys.readouterr().err


def test_an_existing_folder_is_not_touched(recorded, files, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    assert train(recorded, tmp_path / "out", files) == 1
    assert "exists already" in capsys.readouterr().err
    assert not list((tmp_path / "out").iterdir())


def test_a_setting_that_does_not_exist_is_refused(recorded, files, tmp_path, capsys):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("/**:\n  ros__parameters:\n    evaluation: 6\n")
    assert train(recorded, tmp_path / "out", [*files[:2], "--settings", str(wrong)]) == 1
    message = capsys.readouterr().err
    assert "sets evaluation, which do not belong in the learner's settings" in message
    assert "evaluations" in message


def test_it_needs_no_ros(recorded, files, tmp_path):
    script = (
        "import sys; from irlpilco_ros.cli import main; code = main(sys.argv[1:]); "
        "assert not [name for name in sys.modules if name.startswith('rclpy')]; sys.exit(code)"
    )
    words = ["train", "--demonstration", str(recorded / "demonstration"), "--trials"]
    words += [str(recorded / "trials"), "--run-directory", str(tmp_path / "out"), *files]
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "iteration 1: model" in done.stderr


def test_a_train_that_fails_leaves_no_folder(recorded, files, tmp_path, capsys):
    robot = tmp_path / "robot.yaml"
    robot.write_text(toy_robot.ROBOT_FILE.replace("joints:", "features: tools\n    joints:"))
    assert train(recorded, tmp_path / "out", ["--robot", str(robot), *files[2:]]) == 1
    assert capsys.readouterr().err.startswith("irlpilco: ")
    assert not (tmp_path / "out").exists()


def test_a_run_directory_through_a_file_is_refused_in_a_line(recorded, files, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert train(recorded, tmp_path / "file" / "out", files) == 1
    assert "file/out: Not a directory" in capsys.readouterr().err


def test_trials_may_be_called_anything_and_come_in_natural_order(recorded, files, tmp_path, capsys):
    trials = tmp_path / "trials"
    shutil.copytree(recorded / "trials" / "000", trials / "take 2")
    shutil.copytree(recorded / "trials" / "001", trials / "take 10")
    (trials / "take 5").mkdir()
    (trials / "take 5" / "x.mcap").touch()
    (trials / "notes.txt").touch()
    assert train(recorded, tmp_path / "out", files, trials=trials) == 0
    printed = capsys.readouterr()
    assert "take 2 is trial 000\ntake 10 is trial 001\n" in printed.out
    assert "passed over: take 5: " in printed.err
    for name in ("policy_001.yaml", "policy_002.yaml"):
        assert (tmp_path / "out" / name).read_bytes() == (recorded / name).read_bytes()
    learner = Apprenticeship.open(tmp_path / "out", None, toy_robot.ROBOT, SETTINGS)
    assert learner.next_index == 2
    learner.close()


def test_a_topic_of_joint_states_is_chosen_for_the_run_and_stays_chosen(
    recorded, files, tmp_path, capsys
):
    """Two topics in the demonstration tell the same joints; those of the trials need no choice."""
    demonstration = tmp_path / "both"
    with DurableBagWriter(demonstration) as writer:
        for message in read_messages(recorded / "demonstration"):
            for side in ("left", "right"):
                topic = BagTopic.joint_state(f"/{side}/joint_states")
                writer.append(dataclasses.replace(message, topic=topic))
    words = ["train", "--demonstration", str(demonstration), "--trials", str(recorded / "trials")]
    words += ["--run-directory", str(tmp_path / "out"), *files]
    assert main(words) == 1
    assert "choose one of them by joint_states_topic" in capsys.readouterr().err
    assert main([*words, "--joint-states-topic", "/left/joint_states"]) == 0
    policy = "policy_002.yaml"
    assert (tmp_path / "out" / policy).read_bytes() == (recorded / policy).read_bytes()
    with pytest.raises(RunDirectoryError, match="joint_states_topic"):
        Apprenticeship.open(tmp_path / "out", None, toy_robot.ROBOT, SETTINGS)
    left = "/left/joint_states"
    run = Apprenticeship.open(tmp_path / "out", None, toy_robot.ROBOT, SETTINGS, left)
    assert run.next_index == 2
    run.close()
