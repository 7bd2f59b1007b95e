"""The way of docs/own_robot.md, up to the replay, with a driver that is none of ours."""

from __future__ import annotations

import re
import sys

import pytest
from other_driver import JOINTS
from urdf_examples import joint, robot

from irlpilco_ros.cli import main

LIMIT = 'lower="-3.1" upper="3.1" velocity="3" effort="100"'
CONTROL = "".join(
    f'<joint name="{name}"><command_interface name="velocity"/></joint>' for name in JOINTS
)
PATIENCE = {"state_timeout": 1.0, "command_timeout": 1.0}  # the driver runs in real time


def urdf():
    links = ["base", *(f"link{k}" for k in range(len(JOINTS)))]
    joints = [
        joint(name, "revolute", links[k], links[k + 1], limit=LIMIT)
        for k, name in enumerate(JOINTS)
    ]
    return robot(joints, more=f"<ros2_control>{CONTROL}</ros2_control>")


@pytest.mark.dds
def test_from_a_urdf_to_a_replay(ros, tmp_path, monkeypatch, capsys, repository):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(urdf())
    assert main(["robot", "arm.urdf", "--out", "my_robot.yaml"]) == 0
    file = tmp_path / "my_robot.yaml"
    file.write_text(
        file.read_text().replace("# velocity_controller_output", "velocity_controller_output")
    )
    ros.run([sys.executable, str(repository / "tests/other_driver.py")], log="driver.log")
    ros.wait_for(lambda: ros.node.get_publishers_info_by_topic("/joint_states"), "the driver")
    capsys.readouterr()
    main(["check", "--robot", str(file)])  # a busy computer may be too late for the rate
    told = capsys.readouterr().out
    for line in (
        "names: all 6 joints are told",
        "receiver: other_driver",
        "positions: ",
        "efforts: ",
    ):
        assert f"ok    {line}" in told, told
    for node in ("controller", "demonstration_recorder"):
        ros.start(f"irlpilco_ros.nodes.{node}", files=[file], parameters=PATIENCE)
    recordings = {"output_directory": str(tmp_path / "recordings")}
    assert ros.set_parameters("demonstration_recorder", recordings).successful
    assert ros.trigger("demonstration_recorder/start").success
    assert ros.trigger("other_driver/show").success
    ros.wait_for(lambda: "shown" in (tmp_path / "driver.log").read_text(), "the motion's end")
    assert ros.trigger("demonstration_recorder/stop").success
    words = ["--robot", str(file), "--out", str(tmp_path / "replays")]
    assert main(["replay", str(tmp_path / "recordings/000"), *words]) == 0
    off = re.search(r"(0\.\d+) rad off at the decisions", capsys.readouterr().out)
    assert off is not None
    assert 0.001 < float(off[1]) < 0.1  # the driver is slow and late, and no more
