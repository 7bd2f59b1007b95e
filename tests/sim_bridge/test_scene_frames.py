"""The frames of the simulated scene: those of its URDF, and where the simulation has them."""

from __future__ import annotations

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from irlpilco_ros.kinematics.rigid_motion import pose
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.robot_description import scene_urdf
from sim_bridge.scene_frames import SceneFrames
from sim_bridge.simulation_settings import SimulationSettings


@pytest.fixture(scope="module")
def simulation():
    return BaxterSimulation(SimulationSettings(debris=3))


@pytest.fixture(scope="module")
def frames(simulation):
    return SceneFrames(simulation.model)


@pytest.fixture(scope="module")
def joints():
    return ElementTree.fromstring(scene_urdf()).findall("joint")


def test_each_joint_of_the_urdf_has_its_frame_and_no_other_is_there(frames, simulation, joints):
    in_urdf = {(j.find("parent").get("link"), j.find("child").get("link")) for j in joints}
    places = [*frames.fixed(), *frames.moving(simulation.data, (0.0, 0.0, 0.0))]
    assert {(place.parent, place.name) for place in places} == in_urdf
    assert len(places) == len(in_urdf)
    assert {"table", "dustpan", "brush", "dustpan_lip", "brush_tip", "object"} <= {
        place.name for place in places
    }


def test_what_never_moves_is_where_the_urdf_says(frames, joints):
    origins = {j.find("child").get("link"): j.find("origin") for j in joints}
    for place in frames.fixed():
        origin = origins[place.name]
        xyz, rpy = ([float(x) for x in origin.get(key).split()] for key in ("xyz", "rpy"))
        np.testing.assert_allclose(place.pose, pose(xyz, rpy), atol=1e-9, err_msg=place.name)


def test_chained_from_the_base_they_lead_to_where_the_tools_are(frames, simulation):
    simulation.reset(positions=np.linspace(-0.4, 0.6, 14))
    places = {
        place.name: place
        for place in (*frames.fixed(), *frames.moving(simulation.data, (0.1, -0.05, 0.3)))
    }

    def from_base(name):
        chain = np.eye(4)
        while name != "base":
            chain, name = places[name].pose @ chain, places[name].parent
        return chain

    for tool in ("dustpan_lip", "brush_tip"):
        np.testing.assert_allclose(
            from_base(tool)[:3, 3], simulation.data.site(tool).xpos, atol=1e-9
        )
    np.testing.assert_allclose(from_base("object")[:2, 3], [0.745, -0.2])


def test_the_scene_is_a_urdf_that_others_read_with_shapes_and_without_meshes():
    text = scene_urdf()
    assert "<mesh" not in text
    assert text.count("<visual>") > 50
    compiler = '<mujoco><compiler fusestatic="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(
        text.replace('type="floating"', 'type="fixed"').replace("</robot>", compiler)
    )
    assert {"table", "brush", "object"} <= {model.body(k).name for k in range(model.nbody)}
