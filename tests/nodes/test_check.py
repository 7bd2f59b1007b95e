"""`irlpilco check`: the simulator is right, and a driver of bad habits is told each of them."""

from __future__ import annotations

import pytest
import yaml
from controlled_robot import JOINTS, ROBOT
from fake_robot import FakeRobot
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from irlpilco_ros.cli import main
from irlpilco_ros.ros.qos import JOINT_COMMAND

pytestmark = pytest.mark.dds


@pytest.fixture
def check(ros, tmp_path, monkeypatch, capsys):
    """Run it on a robot; return the exit code and what it printed."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))

    def run(robot, *words):
        path = tmp_path / "robot.yaml"
        path.write_text(yaml.safe_dump({"/**": {"ros__parameters": robot}}))
        code = main(["check", "--robot", str(path), "--seconds", "1", *words])
        return code, capsys.readouterr().out

    return run


def test_the_simulator_is_right_and_two_of_its_joints_are_nudged(ros, check):
    ros.start("sim_bridge.baxter_simulator_node", parameters={"lockstep": True})
    robot = {
        "joints": ["left_w0", "right_s0"],
        "position_lower": [-3.059, -1.70167993878],
        "position_upper": [3.059, 1.70167993878],
        "velocity_limit": [4.0, 1.5],
    }
    code, told = check(robot, "--nudge")
    assert code == 0, told
    assert "ok    names: all 2 joints are told; left alone: head_nod" in told
    assert "ok    receiver: baxter_simulator" in told
    assert "ok    left_w0: makes 0." in told
    assert "ok    right_s0: makes 0.9" in told
    assert told.endswith("all right\n")


def test_every_bad_habit_of_a_driver_is_told(ros, check):
    def distort(message):
        message.velocity = []
        message.header.stamp.sec = message.header.stamp.nanosec = 0

    with FakeRobot(ros, JOINTS, listeners=0) as robot:
        robot.distort = distort
        robot.positions["wrist"] = 1.5
        stranger = ros.node.create_publisher(JointState, "joint_command", JOINT_COMMAND)
        code, told = check(ROBOT, "--nudge")
        ros.node.destroy_publisher(stranger)
    assert code == 1
    for line in (
        "WRONG velocities: missing, or no numbers, of elbow, wrist",
        "WRONG stamps: zero",
        "WRONG positions: wrist is at 1.5000 rad, beyond its limits [-1, 1] rad",
        f"WRONG commands: joint_command is published by {ros.node.get_name()}; nobody but",
        "WRONG nudge: not moved, /joint_command is published by",
    ):
        assert line in told
    assert not robot.commands


def test_a_receiver_that_moves_on_without_commands_is_told(ros, check):
    with FakeRobot(ros, JOINTS, wall_step=0.01, listeners=0) as robot:
        code, told = check(ROBOT, "--nudge")
        assert code == 1
        assert "WRONG time-out: elbow goes on for 1 s without a command" in told
        assert list(robot.commands[-1].velocity) == [0.0, 0.0]
        assert "ok    elbow: makes 1.00 of its command" in told


def test_nothing_is_nudged_by_what_nobody_hears(ros, check):
    with FakeRobot(ros, JOINTS, wall_step=0.01, listeners=0) as robot:
        code, told = check({**ROBOT, "velocity_controller_output": True}, "--nudge")
    assert code == 1
    assert "WRONG receiver: nobody listens on velocity_controller/commands" in told
    assert "WRONG nudge: not moved, nobody listens to the commands" in told
    assert not robot.commands


def test_another_name_of_the_output_is_given_as_to_the_controller(ros, check):
    robot = {**ROBOT, "velocity_controller_output": True}
    remap = ("-r", "velocity_controller/commands:=wheels/commands")
    ros.listen(Float64MultiArray, "wheels/commands")
    _, told = check(robot)
    assert "WRONG receiver: nobody listens on velocity_controller/commands" in told
    _, told = check(robot, *remap)
    assert f"ok    receiver: {ros.node.get_name()}" in told


def test_a_remapping_that_is_none_ends_it_with_a_sentence(check):
    code, told = check(ROBOT, "-r", "commands")
    assert (code, told) == (1, "")


def test_where_nobody_is_it_says_so(ros, check):
    code, told = check(ROBOT)
    assert code == 1
    assert "WRONG joint states: 0 in 1 s; expected some of elbow, wrist" in told
    assert "WRONG receiver: nobody listens on joint_command" in told
    assert "2 of 3 are wrong" in told
