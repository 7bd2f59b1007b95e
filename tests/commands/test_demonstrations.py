"""`irlpilco inspect --robot` and `irlpilco train` on demonstrations of all kinds."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
import toy_robot

from irlpilco_ros.cli import main
from irlpilco_ros.commands.settings_files import read_robot_settings
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.bag_message import BagMessage, BagTopic
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.demonstrations import checked_demonstrations
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=3, options={"linear_phase.count": 3})
DURATION = toy_robot.HORIZON * toy_robot.PERIOD


def dense(rate=20.0, before=0.0, after=0.0, joints=toy_robot.JOINTS, wrap=0.0) -> Trajectory:
    """The toy robot's motion at any rate, turned by `wrap`, with standstill before and after."""
    times = np.arange(round((before + DURATION + after) * rate) + 1) / rate
    t = np.clip(times - before, 0.0, DURATION)
    moves = ((times >= before) & (times <= before + DURATION))[:, None]
    positions = np.stack([0.4 * np.sin(0.9 * t), 0.3 - 0.3 * np.cos(0.7 * t)], axis=1)
    velocities = np.stack([0.36 * np.cos(0.9 * t), 0.21 * np.sin(0.7 * t)], axis=1) * moves
    if wrap:
        positions[:, 0] = np.angle(np.exp(1j * (positions[:, 0] + wrap)))
    nothing = np.full(positions.shape, np.nan)
    return Trajectory(joints, 5.0 + times, positions, velocities, nothing)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Demonstration at 2 Hz and two trials of its policies."""
    path = tmp_path_factory.mktemp("recorded")
    bag = toy_robot.record_demonstration(path / "shown")
    run = Apprenticeship.open(path / "run", bag, toy_robot.ROBOT, SETTINGS)
    for _ in range(2):
        run.finish(toy_robot.record_trial(run.prepare(), run.directory.trials_directory))
    rows = run.directory.metrics()
    run.close()
    return path / "run", rows


def inspect(bag, files):
    """Run `irlpilco inspect` with the parameters files of a robot and its learner."""
    return main(["inspect", str(bag), "--robot", str(files[0]), "--settings", str(files[1])])


@pytest.fixture
def files(tmp_path):
    robot, settings = tmp_path / "robot.yaml", tmp_path / "settings.yaml"
    robot.write_text(toy_robot.ROBOT_FILE)
    settings.write_text("/**:\n  ros__parameters:\n    evaluations: 3\n    linear_phase.count: 3\n")
    return robot, settings


def train(demonstration, trials, files, out, *more):
    words = ["train", "--demonstration", str(demonstration), "--trials", str(trials)]
    words += ["--robot", str(files[0]), "--settings", str(files[1]), "--run-directory", str(out)]
    return main([*words, *more])


def errors(out):
    return [row.rmse_rad for row in RunDirectory(out).metrics()]


@pytest.mark.parametrize(
    "shown", [dense(), dense(100.0, 1.25, 0.75), dense(20.0, 2.0, 0.0)], ids=["20", "100", "before"]
)
def test_a_dense_recording_is_the_same_demonstration(recorded, files, tmp_path, capsys, shown):
    run, rows = recorded
    assert train(write_trajectory(tmp_path, shown), run / "trials", files, tmp_path / "out") == 0
    printed = capsys.readouterr()
    assert "s of motion, from " in printed.err
    for found, row in zip(errors(tmp_path / "out"), rows, strict=True):
        assert found == pytest.approx(row.rmse_rad, abs=3e-3)


def parts(bag, shown):
    """Each message tells one joint, as two drivers do on one topic."""
    topic = BagTopic.joint_state("/joint_states")
    with DurableBagWriter(bag) as writer:
        for k, seconds in enumerate(shown.stamps):
            for j, name in enumerate(shown.joint_names):
                stamp = round(1e9 * seconds)
                position, velocity = float(shown.positions[k, j]), float(shown.velocities[k, j])
                message = JointStateMessage(stamp, (name,), (position,), (velocity,))
                writer.append(BagMessage(topic, encode(message), stamp + 9999 * j, stamp))
    return bag


def test_joints_told_in_parts_are_merged(recorded, files, tmp_path, capsys):
    bag = parts(tmp_path / "parts", dense())
    assert train(bag, recorded[0] / "trials", files, tmp_path / "out") == 0
    assert errors(tmp_path / "out")[0] == pytest.approx(recorded[1][0].rmse_rad, abs=3e-3)


REFUSED = {
    "long": (dense(after=9.0, before=1.0), "", 0),
    "too long": (
        dataclasses.replace(dense(), stamps=5.0 + 3.0 * (dense().stamps - 5.0)),
        "the horizon of 6 decisions takes 3 s, but it shows",
        1,
    ),
    "coarse": (
        dataclasses.replace(dense(2.0), stamps=5.0 + 2.0 * (dense(2.0).stamps - 5.0)),
        "a sample every 1.000 s, too few for the control_period of 0.5 s",
        1,
    ),
    "degrees": (
        dataclasses.replace(dense(), positions=np.rad2deg(dense().positions)),
        "in degrees, and radians are expected",
        1,
    ),
    "another robot": (dense(joints=("hip", "knee")), "not recorded: shoulder, elbow", 1),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_inspect_says_what_train_does(recorded, files, tmp_path, capsys, kind):
    shown, reason, code = REFUSED[kind]
    bag = write_trajectory(tmp_path, shown)
    assert train(bag, recorded[0] / "trials", files, tmp_path / "out") == code
    said = capsys.readouterr().err
    assert (tmp_path / "out").exists() == (code == 0)
    assert inspect(bag, files) == 0
    lines = capsys.readouterr().out.splitlines()
    (verdict,) = [line for line in lines if line.startswith("as a demonstration: ")]
    assert reason in verdict
    assert reason in said
    assert ("refused" in verdict) == bool(code)


def test_inspect_says_how_good_a_recording_is(files, tmp_path, capsys):
    shown = dense(100.0, 1.0, 1.0)
    noise = 4e-4 * np.random.default_rng(0).standard_normal(shown.positions.shape)
    noisy = dataclasses.replace(shown, positions=shown.positions + noise)
    bag = write_trajectory(tmp_path, noisy)
    assert inspect(bag, files) == 0
    text = capsys.readouterr().out
    assert "6 decisions of 0.5 s, from 1." in text
    assert "rate: 100.0 Hz; the longest time without a sample is 0.010 s" in text
    noise_found = re.search(r"noise: ([0-9.]+) rad in", text)
    assert noise_found is not None
    assert float(noise_found[1]) == pytest.approx(4e-4, rel=0.1)
    assert re.search(r"closest to a limit: elbow comes within 1\.5\d+ rad of its upper limit", text)
    assert "fastest: shoulder needs 0.3" in text


def test_inspect_says_what_a_trial_is_to_the_robot(recorded, files, tmp_path, capsys):
    trial = str(recorded[0] / "trials" / "000")
    assert inspect(trial, files) == 0
    assert "as a trial: 6 decisions, one every 0.5 s" in capsys.readouterr().out
    files[0].write_text(toy_robot.ROBOT_FILE.replace("control_period: 0.5", "control_period: 0.1"))
    assert inspect(trial, files) == 0
    said = capsys.readouterr().out
    assert "its commands were decided every 0.500 s; the robot's control_period is 0.1 s" in said


def test_a_window_is_imitated_instead(recorded, files, tmp_path, capsys):
    bag = write_trajectory(tmp_path, dense(before=1.0, after=5.0))
    window = ["--demonstration-window", "1.0", "4.0"]
    assert train(bag, recorded[0] / "trials", files, tmp_path / "out", *window) == 0
    assert "imitated from 1.0 s on; 6 decisions" in capsys.readouterr().err
    run = Apprenticeship.open(tmp_path / "out", None, toy_robot.ROBOT, SETTINGS, window=(1.0, 4.0))
    assert run.next_index == 2
    run.close()


def test_the_length_of_a_trial_follows_from_the_demonstration(recorded, files, tmp_path, capsys):
    files[0].write_text(toy_robot.ROBOT_FILE.replace("horizon: 6", "horizon: 0"))
    assert train(recorded[0] / "demonstration", recorded[0] / "trials", files, tmp_path / "a") == 0
    long = dataclasses.replace(dense(), stamps=5.0 + 2.0 * (dense().stamps - 5.0))
    long = dataclasses.replace(long, velocities=0.5 * long.velocities)
    bag = write_trajectory(tmp_path, long)
    capsys.readouterr()
    assert train(bag, recorded[0] / "trials", files, tmp_path / "b") == 1
    assert "000: the trial has 6 of 12 control periods" in capsys.readouterr().err


def test_a_turning_joint_is_learned_through_its_wrap(files, tmp_path, capsys):
    """Trial 0 turns it the way that was shown, and training goes on."""
    robot = toy_robot.ROBOT_FILE.replace("horizon", "continuous_joints: [shoulder]\n    horizon")
    files[0].write_text(robot.replace("[2.0, 2.0]", "[4.0, 2.0]").replace("[-2.0,", "[-4.0,"))
    shown = dense(2.0, wrap=np.pi - 0.2)
    assert np.abs(np.diff(shown.positions[:, 0])).max() > 6.0
    bag = write_trajectory(tmp_path / "shown", shown)
    settings = dataclasses.replace(SETTINGS, evaluations=2)
    turning = dataclasses.replace(
        toy_robot.ROBOT,
        continuous_joints=("shoulder",),
        position_lower=(-4.0, -2.0),
        position_upper=(4.0, 2.0),
    )
    run = Apprenticeship.open(tmp_path / "run", bag, turning, settings)
    policy = run.prepare().iteration.policy
    states = run.task.reference_states()
    acting = PolicyOf(turning.roles, policy)
    turn = [acting.act(x, k)[0] for k, x in enumerate(states[:-1])]
    np.testing.assert_allclose(turn, np.diff(dense(2.0).positions[:, 0]) / 0.5, atol=0.05)
    run.close()
    commands = np.vstack([np.tile([0.2, 0.1], (toy_robot.HORIZON, 1)), np.zeros((1, 2))])
    trial = dataclasses.replace(shown, commands=commands)
    write_trajectory(tmp_path / "trials", trial)
    assert train(bag, tmp_path / "trials", files, tmp_path / "out") == 0
    (error,) = errors(tmp_path / "out")
    assert error == 0.0


def test_inspect_judges_the_motion_that_the_learner_takes(repository, capsys):
    """All that was recorded of it, of which the samples are a part."""
    bag, robot = repository / "bags/sweep/demonstration", repository / "config/baxter.yaml"
    learner = repository / "config/cornered_sweep.yaml"
    assert inspect(bag, (robot, learner)) == 0
    (shown,) = checked_demonstrations(bag, read_robot_settings(robot))
    assert shown.motion is not None
    said = capsys.readouterr().out
    assert f"; {shown.motion.sentence()}\n" in said
    assert "16 decisions of 0.5 s" in said
    assert f"pace: control_period is 0.5 s ({robot})" in said


def test_inspect_judges_at_the_pace_at_which_will_be_learned(repository, capsys):
    """By default that of config/sweep.yaml, as of `irlpilco train` and of docs/own_robot.md."""
    bag, robot = repository / "bags/sweep/demonstration", repository / "config/baxter.yaml"
    assert main(["inspect", str(bag), "--robot", str(robot)]) == 0
    said = capsys.readouterr().out
    assert "31 decisions of 0.25 s" in said
    assert f"pace: control_period is 0.25 s ({repository / 'config/sweep.yaml'})" in said


@pytest.mark.parametrize("words", [["--settings", "a.yaml"], ["--demonstration-window", "1", "2"]])
def test_inspect_needs_the_robot_to_say_what_it_learns(repository, capsys, words):
    assert main(["inspect", str(repository / "bags/sweep/demonstration"), *words]) == 1
    assert "name its parameters file, too, with --robot" in capsys.readouterr().err
