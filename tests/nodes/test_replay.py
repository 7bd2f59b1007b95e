"""`irlpilco replay`: the controller plays a bag back, the recorder keeps it, its error is told."""

from __future__ import annotations

import re

import pytest
import toy_robot
from fake_robot import FakeRobot

from irlpilco_ros.cli import main


@pytest.mark.dds
def test_a_motion_is_played_back_and_judged(ros, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    file = tmp_path / "robot.yaml"
    file.write_text(toy_robot.ROBOT_FILE)
    bag = toy_robot.record_demonstration(tmp_path / "shown")
    patience = {"state_timeout": 1.0, "command_timeout": 1.0}
    ros.start("irlpilco_ros.nodes.controller", files=[file], parameters=patience)
    ros.start("irlpilco_ros.nodes.demonstration_recorder", files=[file])
    words = ["--robot", str(file), "--settings", str(_settings(tmp_path))]
    with FakeRobot(ros, toy_robot.JOINTS, listeners=2, lockstep=True) as robot:
        code = main(["replay", str(bag), *words, "--out", str(tmp_path / "replays")])
        told = capsys.readouterr().out
        assert list(robot.commands[-1].velocity) == [0.0, 0.0]
    assert code == 0
    off = re.search(r"replays/000: (0\.\d+) rad off at the decisions", told)
    assert off is not None, told
    assert float(off[1]) < 0.01  # this robot does what it is told
    assert (tmp_path / "replays/000/metadata.yaml").is_file()


@pytest.mark.dds
def test_without_a_controller_it_says_so(ros, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    file = tmp_path / "robot.yaml"
    file.write_text(toy_robot.ROBOT_FILE)
    bag = toy_robot.record_demonstration(tmp_path / "shown")
    words = ["--robot", str(file), "--settings", str(_settings(tmp_path))]
    assert main(["replay", str(bag), *words, "--out", str(tmp_path / "replays")]) == 1
    error = capsys.readouterr().err
    assert "service controller/set_parameters_atomically is not there" in error
    assert error.count("\n") == 1


def _settings(folder):
    """Settings of a learner that leave the robot its own pace."""
    path = folder / "settings.yaml"
    path.write_text("/**:\n  ros__parameters:\n    seed: 0\n")
    return path
