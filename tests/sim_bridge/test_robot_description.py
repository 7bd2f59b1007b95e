"""The URDFs are those of the simulated robots."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.resources import config_file, named_file
from sim_bridge.arm_simulation import PANDA
from sim_bridge.baxter_model import SCENE
from sim_bridge.robot_description import DESCRIPTIONS

SITES = {"baxter": (SCENE, ("dustpan_lip", "brush_tip")), "panda": (PANDA, ("sponge",))}


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_the_files_are_up_to_date(name):
    path = named_file(f"package://irlpilco_ros/config/{name}")
    assert path.read_text() == DESCRIPTIONS[name](), "run python -m sim_bridge.robot_description"


@pytest.mark.parametrize("name", SITES)
def test_tools_are_where_the_simulated_robot_has_them(name):
    scene, sites = SITES[name]
    values = load_parameters_file(config_file(f"{name}.yaml"), "learner")
    robot = settings_from_parameters(RobotSettings, values)
    kinematics = kinematics_of(settings_from_parameters(ToolSettings, values), robot.joints)
    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    places = [model.joint(joint).qposadr[0] for joint in robot.joints]
    for positions in np.random.default_rng(0).uniform(robot.lower, robot.upper, (20, len(places))):
        data.qpos[places] = positions
        mujoco.mj_kinematics(model, data)
        for reached, site in zip(kinematics.poses(positions), sites, strict=True):
            expected = data.site(site)
            np.testing.assert_allclose(reached[:3, 3], expected.xpos, atol=5e-5)
            np.testing.assert_allclose(reached[:3, :3].ravel(), expected.xmat, atol=5e-5)


def test_limits_and_masses_are_in_it():
    text = DESCRIPTIONS["baxter.urdf"]()
    assert 'lower="-0.05" upper="2.618" velocity="1.5" effort="50"' in text
    assert '<mass value="5.70044" />' in text
