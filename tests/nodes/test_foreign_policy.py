"""A policy of another package, learned and run by the real nodes without an edit in this one."""

from __future__ import annotations

import os

import pytest
import toy_robot
from fake_robot import FakeRobot
from installed_example import install_example

from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.experience.run_directory import RunDirectory

pytestmark = pytest.mark.dds

CONTROLLER = "irlpilco_ros.nodes.controller"


def test_learner_policy_file_and_controller(ros, tmp_path):
    site = install_example(tmp_path)
    ros.environment["PYTHONPATH"] += os.pathsep + str(site)
    robot_file = tmp_path / "robot.yaml"
    robot_file.write_text(toy_robot.ROBOT_FILE)
    learning = {
        "policy": "polynomial",
        "polynomial.degree": 2,
        "evaluations": 6,
        "run_directory": str(tmp_path / "run"),
        "demonstration": str(toy_robot.record_demonstration(tmp_path / "shown")),
        "initial_policy": "zero",
    }
    start = toy_robot.demonstrated().positions[0].tolist()
    controller = ros.start(CONTROLLER, files=[robot_file])
    with FakeRobot(ros, toy_robot.JOINTS, start, lockstep=True):
        ros.start(
            "irlpilco_ros.nodes.demonstration_recorder",
            files=[robot_file],
            parameters={"output_directory": str(tmp_path / "recordings")},
        )
        ros.start("irlpilco_ros.nodes.learner", files=[robot_file], parameters=learning)
        for _ in range(2):
            answer = ros.trigger("learn_iteration")
            assert answer.success, answer.message
        rows = RunDirectory(tmp_path / "run").metrics()
        assert rows[-1].rmse_rad < rows[0].rmse_rad / 3
        file = tmp_path / "run" / "policy_002.yaml"
        parameters = load_parameters_file(file, "controller")
        assert parameters["policy.kind"] == "polynomial"
        assert len(parameters["policy.coefficients"]) == 2 * 3
        # The controller runs it from its file, without a learner.
        controller.stop()
        ros.start(CONTROLLER, files=[file])
        ros.wait_for(  # until it has heard of the robot
            lambda: ros.trigger("controller/move_to_start").success, "the start"
        )
        answer = ros.trigger("controller/run_trial")
        assert answer.success, answer.message
