"""`irlpilco robot`: a parameters file with which the nodes start."""

from __future__ import annotations

import io

import pytest
from std_msgs.msg import String
from urdf_examples import ARM, TORSO

from irlpilco_ros.cli import main
from irlpilco_ros.ros.qos import LATCHED


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def test_it_says_what_it_made_and_what_is_to_be_done(urdf, tmp_path, capsys):
    out = tmp_path / "my_robot.yaml"
    assert main(["robot", str(urdf), "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"{out}: 4 joints of arm\n  arm: lift, shoulder, elbow; tool: tool0\n")
    assert f"irlpilco check --robot {out}" in told
    assert f'urdf: "{urdf}"' in out.read_text()


@pytest.mark.parametrize(
    ("given", "written"),
    [
        ("more/../arm.urdf", "arm.urdf"),
        ("./arm.urdf", "arm.urdf"),
        ("link/arm.urdf", "link/arm.urdf"),  # a link stays: what it leads to may change
        ("link/../arm.urdf", "elsewhere/arm.urdf"),  # but up from it is where it leads to
    ],
)
def test_the_path_of_the_urdf_is_a_plain_one(urdf, tmp_path, monkeypatch, given, written):
    for folder in ("more", "elsewhere/deep"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere/deep")
    for folder in ("elsewhere", "elsewhere/deep"):
        (tmp_path / folder / "arm.urdf").write_text(ARM)
    monkeypatch.chdir(tmp_path)
    assert main(["robot", given, "--out", "my_robot.yaml"]) == 0
    assert f'urdf: "{tmp_path / written}"' in (tmp_path / "my_robot.yaml").read_text()


def test_a_urdf_that_is_kept_has_a_plain_path_too(tmp_path, monkeypatch):
    (tmp_path / "more").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO(ARM))
    assert main(["robot", "-", "--out", "more/../my_robot.yaml"]) == 0
    assert f'urdf: "{tmp_path / "my_robot.urdf"}"' in (tmp_path / "my_robot.yaml").read_text()


def test_a_urdf_in_a_package_is_named_as_such(tmp_path, monkeypatch):
    share = tmp_path / "share/arm_description/urdf"
    share.mkdir(parents=True)
    (share / "arm.urdf").write_text(ARM)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    name = "package://arm_description/urdf/arm.urdf"
    assert main(["robot", name, "--out", "my_robot.yaml"]) == 0
    assert f'urdf: "{name}"' in (tmp_path / "my_robot.yaml").read_text()


def test_a_urdf_from_a_pipe_is_kept_beside_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO(TORSO))
    out = tmp_path / "my_robot.yaml"
    assert main(["robot", "-", "--out", str(out), "--joints", "left"]) == 0
    assert (tmp_path / "my_robot.urdf").read_text() == TORSO
    assert "left_shoulder, left_elbow, left_wrist]" in out.read_text()


def test_what_is_there_is_not_overwritten(urdf, tmp_path, monkeypatch, capsys):
    out = tmp_path / "arm.yaml"
    out.write_text("mine")
    assert main(["robot", str(urdf), "--out", str(out)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert out.read_text() == "mine"
    monkeypatch.setattr("sys.stdin", io.StringIO(TORSO))
    out.unlink()
    assert main(["robot", "-", "--out", str(out)]) == 1  # arm.urdf is there
    assert urdf.read_text() == ARM
    assert not out.exists()


@pytest.mark.parametrize("text", ["no urdf", "<robot/>", ""])
def test_what_is_no_robot_is_refused_in_a_line(urdf, tmp_path, text, capsys):
    urdf.write_text(text)
    assert main(["robot", str(urdf), "--out", str(tmp_path / "out.yaml")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("irlpilco: ")
    assert error.count("\n") == 1
    assert not (tmp_path / "out.yaml").exists()


@pytest.mark.dds
def test_from_a_topic_it_is_a_file_with_which_the_nodes_start(ros, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    publisher = ros.node.create_publisher(String, "robot_description", LATCHED)
    publisher.publish(String(data=ARM))
    out = tmp_path / "my_robot.yaml"
    assert main(["robot", "--from-topic", "--out", str(out)]) == 0
    for node in ("controller", "demonstration_recorder", "learner"):
        ros.start(f"irlpilco_ros.nodes.{node}", files=[out])
        joints = ros.get_parameter(node, "joints")
        assert joints == ["lift", "shoulder", "elbow", "left_finger"]
    assert ros.get_parameter("learner", "tool_links") == ["tool0"]


@pytest.mark.dds
def test_a_topic_on_which_nobody_tells_anything_is_said_so(ros, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    monkeypatch.setattr("irlpilco_ros.commands.robot.PATIENCE", 0.5)
    assert main(["robot", "--from-topic", "other", "--out", str(tmp_path / "a.yaml")]) == 1
    assert "nobody told a robot's description on /other" in capsys.readouterr().err
