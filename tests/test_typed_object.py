"""Going on where the object is typed in, as docs/moving_object.md says, with real nodes.

The simulator's camera is turned away, so that nobody but who types tells where the object is; what
was learned before is that of bags/sweep.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import PoseStamped
from ros_graph import REPOSITORY

from irlpilco_ros.cli import main
from irlpilco_ros.experience.places import read_places
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.ros.qos import OBJECT_POSE_PUB

pytestmark = [pytest.mark.dds, pytest.mark.slow]


def going_on_there() -> list[str]:
    """Return the commands by which docs/moving_object.md goes on where the object is now."""
    text = (REPOSITORY / "docs/moving_object.md").read_text(encoding="utf-8")
    block = re.search(r"## Going on there\s+```sh\n(.*?)```", text, re.DOTALL)
    assert block is not None
    return block.group(1).replace("\\\n", " ").strip().splitlines()


def typed_pose(values: dict[str, Any]) -> PoseStamped:
    """Return a message as `ros2 topic pub` makes it: what is not typed keeps its default."""
    message = PoseStamped()
    for part, numbers in values.items():
        for name, number in numbers.items():
            setattr(getattr(message.pose, part), name, float(number))
    return message


def type_in(ros, command: str) -> str:
    """Do what a command does; return what is answered."""
    call = re.fullmatch(r"ros2 service call /(\S+) std_srvs/srv/Trigger(?: *#.*)?", command)
    if call is not None:
        answer = ros.trigger(call.group(1), timeout=200.0)
        for _ in range(2):  # where a busy computer was held up, stopping is right
            if "was the controller, or its computer, held up?" in answer.message:
                assert ros.trigger("controller/move_to_start", timeout=200.0).success
                answer = ros.trigger(call.group(1), timeout=200.0)
        assert answer.success, answer.message
        return str(answer.message)
    publishing = r"ros2 topic pub --once /(\S+) geometry_msgs/msg/PoseStamped +'(.*)'"
    pose = re.fullmatch(publishing, command)
    assert pose is not None, f"the page has a command that is not known here: {command}"
    poses = ros.publisher(PoseStamped, pose.group(1), OBJECT_POSE_PUB, subscribers=6)
    poses.publish(typed_pose(yaml.safe_load(pose.group(2))["pose"]))
    return ""


def start_nodes(ros, run: RunDirectory) -> None:
    """Start robot, controller, recorder and learner."""
    baxter, nodes = "config/baxter.yaml", "irlpilco_ros.nodes"
    ros.start(
        "sim_bridge.baxter_simulator_node",
        "-r",
        "object_pose:=camera",
        files=["config/baxter_simulator.yaml"],
        parameters={"debris": 0, "lockstep": True},
    )
    ros.start(f"{nodes}.controller", files=[baxter], wait=False)
    ros.start(f"{nodes}.demonstration_recorder", files=[baxter], wait=False)
    settings = {"run_directory": str(run.path)}
    files = [baxter, "config/sweep.yaml"]
    ros.start(f"{nodes}.learner", files=files, parameters=settings, wait=False)
    for name in ("controller", "demonstration_recorder", "learner"):
        ros.wait_for_node(name, timeout=60.0)


def test_where_the_object_is_typed_in_the_sweep_is_done_there(ros, tmp_path):
    bags = REPOSITORY / "bags" / "sweep"
    run = RunDirectory(tmp_path / "run")
    words = ["--demonstration", f"{bags / 'demonstration'}", "--trials", f"{bags / 'trials'}"]
    assert main(["train", *words, "--run-directory", str(run.path)]) == 0
    start_nodes(ros, run)
    answers = {line: type_in(ros, line) for line in going_on_there()}
    (adapted,) = (text for line, text in answers.items() if "/learner/adapt " in line)
    typed = re.search(r"moved by \((.*?), (.*?)\) m and (.*?) rad: (\S+) rad off", adapted)
    assert typed is not None, adapted
    x, y, turn, predicted = map(float, typed.groups())
    np.testing.assert_allclose((x, y, turn), (0.045, -0.03, 0.2), atol=0.005)
    assert predicted < 0.01
    assert len(read_places(run.places_directory)) == 1
    row = run.metrics()[-1]
    assert row.iteration == 2
    assert row.path_rmse_rad < 0.02
    assert row.rmse_rad < 0.015
