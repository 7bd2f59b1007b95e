"""`features: tools`: the sweep is learned by where the tools are, here and where the pile went."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import practising_arm
import pytest
from practising_arm import ROBOT, SETTINGS, robot_file

from irlpilco_ros.commands.object_place import adapter_of, moved_to
from irlpilco_ros.experience.adapting import AdaptSettings
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.experience.robot_settings import RobotSettings, robot_from_parameters
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning import LearningSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import values_of
from irlpilco_ros.resources import config_file
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import run_episode
from sim_bridge.joints import ARM_JOINTS

SWEEP = Path(__file__).parents[1] / "bags" / "cornered_sweep"


def baxter() -> RobotSettings:
    values = load_parameters_file(config_file("baxter.yaml"), "learner")
    return robot_from_parameters({**values, "features": "tools"})


def record_trial(simulation, plan, robot, folder):
    """Run the trial of a plan, and write its bag as the recorder does."""
    start, policy = plan.parameters["start_position"], plan.iteration.policy
    horizon, period = plan.parameters["trial_horizon"], robot.control_period
    run = run_episode(simulation, policy, start, horizon, period)
    joints, stamps = len(ARM_JOINTS), period * np.arange(1.0, horizon + 2)
    commands = np.vstack([run.controls, np.zeros((1, joints))])
    states = run.states[:, :joints], run.states[:, joints:]
    return write_trajectory(folder, Trajectory(ARM_JOINTS, stamps, *states, commands))


def test_the_sweep_is_learned_by_where_the_tools_are(tmp_path):
    robot, simulation = baxter(), BaxterSimulation()
    settings = LearningSettings(evaluations=6)
    run = Apprenticeship.open(tmp_path / "run", SWEEP / "demonstration", robot, settings)
    assert run.task.feature_map.units == ("m",) * (2 * 3 * 3 + 14)
    for _ in range(3):
        plan = run.prepare()
        run.finish(record_trial(simulation, plan, robot, run.directory.trials_directory))
    distances = [math.sqrt(row.mse) for row in run.directory.metrics()]  # [m] for each coordinate
    run.close()
    assert 0.003 < distances[0] < 0.03
    assert distances[2] < distances[0] / 3
    assert distances[2] < 0.003


def test_where_the_object_has_gone_the_tools_points_are_those_that_were_shown(tmp_path):
    urdf = robot_file(tmp_path).with_suffix(".urdf")
    pen = ToolSettings(str(urdf), ("pen",), ("hand",), (0.0, 0.0, 0.0))
    robot = dataclasses.replace(ROBOT, features="tools", tools=pen)
    run = Apprenticeship.open(
        tmp_path / "run", practising_arm.record_demonstration(tmp_path / "shown"), robot, SETTINGS
    )
    errors = practising_arm.practise(run, 3)
    assert errors[2] < 0.3 * errors[0]
    shown = run.task.reference_features()
    adapter = adapter_of(tmp_path / "arm.yaml", values_of(robot), AdaptSettings())
    adapter.adapt(run, moved_to((-0.05, 0.04, 0.2)))
    there = run.task
    np.testing.assert_allclose(there.reference_features()[:, :9], shown[:, :9], atol=2e-3)
    far = there.reference_states()[:, :3] - run.shown[0].rollout.states[:, :3]
    assert np.abs(far).max() > 0.1
    assert practising_arm.practise(run, 1)[0] < 0.02
    run.close()
    again = Apprenticeship.open(tmp_path / "run", None, robot, SETTINGS)
    np.testing.assert_array_equal(again.task.reference_features(), there.reference_features())
    again.close()


def test_a_robot_whose_tools_are_not_told_is_refused_and_one_that_turns_without_end():
    robot = baxter()
    blind = dataclasses.replace(robot, tools=ToolSettings())
    with pytest.raises(RobotDescriptionError, match="urdf is not set; name urdf, tools"):
        _ = blind.feature_map
    turning = dataclasses.replace(robot, continuous_joints=(ARM_JOINTS[6],))
    with pytest.raises(InvalidSettingError, match=rf"{ARM_JOINTS[6]} turn without end; set feat"):
        _ = turning.feature_map


def test_features_that_nobody_offers_are_refused_by_name():
    with pytest.raises(
        InvalidSettingError, match="features is 'hands'; valid values: motion, joints, tools"
    ):
        dataclasses.replace(baxter(), features="hands")


def test_a_run_with_other_features_is_another_run(tmp_path):
    robot, demonstration = baxter(), SWEEP / "demonstration"
    Apprenticeship.open(tmp_path / "run", demonstration, robot, LearningSettings()).close()
    other = dataclasses.replace(robot, features="joints")
    with pytest.raises(RunDirectoryError, match="features was tools, now joints"):
        Apprenticeship.open(tmp_path / "run", demonstration, other, LearningSettings())
    longer = dataclasses.replace(robot, tools=dataclasses.replace(robot.tools, tool_size=0.2))
    with pytest.raises(RunDirectoryError, match=r"tool_size was 0\.1, now 0\.2"):
        Apprenticeship.open(tmp_path / "run", demonstration, longer, LearningSettings())
