"""What a URDF looks like: frames where MuJoCo has them, shapes as they are written."""

from __future__ import annotations

import numpy as np
import pytest
from urdf_examples import ARM, LIMIT, joint, robot

from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics
from irlpilco_ros.kinematics.tools import Tool
from irlpilco_ros.resources import config_file
from irlpilco_ros.view import mesh_file
from irlpilco_ros.view.urdf_look import GREY, links_of

JOINTS = ("lift", "shoulder", "elbow", "left_finger")


def pose_of(links, name, positions):
    by_name = {link.name: link for link in links}
    chain, link = np.eye(4), by_name[name]
    while link.parent:
        chain = link.moved(positions.get(link.joint, 0.0)) @ chain
        link = by_name[link.parent]
    return chain


@pytest.mark.parametrize(
    ("urdf", "joints", "link"),
    [
        (ARM, JOINTS, "left_tip"),
        (ARM, JOINTS, "tool0"),
        (config_file("panda.urdf").read_text(), [f"panda_joint{k}" for k in range(1, 8)],
         "panda_link7"),
    ],
)  # fmt: skip
def test_links_are_where_mujoco_has_them(urdf, joints, link):
    links = links_of(urdf)
    kinematics = RobotKinematics(urdf, joints, [Tool(link, link, np.eye(4))])
    for positions in np.random.default_rng(0).uniform(-1.0, 1.0, (5, len(joints))):
        expected = kinematics.poses(positions)[0]
        found = pose_of(links, link, dict(zip(joints, positions, strict=True)))
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_parents_come_before_their_children():
    seen = {""}
    for link in links_of(ARM):
        assert link.parent in seen
        seen.add(link.name)


def test_shapes_have_size_place_and_colour():
    visual = (
        '<visual><origin xyz="1 2 3"/><geometry><box size="0.1 0.2 0.3"/></geometry>'
        '<material name="own"><color rgba="1 0 0 0.5"/></material></visual>'
        '<visual><geometry><cylinder radius="0.1" length="2"/></geometry>'
        '<material name="blue"/></visual>'
        '<visual><geometry><sphere radius="0.3"/></geometry></visual>'
    )
    urdf = robot([joint("a", "revolute", "base", "link", limit=LIMIT)])
    urdf = urdf.replace('<link name="base">', f'<link name="base">{visual}')
    urdf = urdf.replace(
        "</robot>", '<material name="blue"><color rgba="0 0 1 1"/></material></robot>'
    )
    box, cylinder, sphere = links_of(urdf)[0].shapes
    assert (box.kind, box.size, box.colour) == ("box", (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.5))
    np.testing.assert_allclose(box.place[:3, 3], [1.0, 2.0, 3.0])
    assert (cylinder.size, cylinder.colour) == ((0.1, 2.0), (0.0, 0.0, 1.0, 1.0))
    assert (sphere.size, sphere.colour) == ((0.3,), GREY)


def test_meshes_are_shown_where_they_are_and_else_there_are_bones(tmp_path):
    bones = links_of(ARM, tmp_path)
    assert all(shape.kind != "mesh" for link in bones for shape in link.shapes)
    assert all(link.shapes for link in bones)
    (length,) = {s.size[1] for link in bones for s in link.shapes if s.kind == "cylinder"}
    assert length == pytest.approx(0.3)
    (tmp_path / "none.stl").touch()
    links = links_of(ARM.replace("package://nobody/none.dae", "none.stl"), tmp_path)
    assert {shape.file for link in links for shape in link.shapes} == {tmp_path / "none.stl"}


def test_what_is_no_number_is_said():
    with pytest.raises(RobotDescriptionError, match="a number of the URDF is none"):
        links_of(ARM.replace('xyz="0 0 0.3"', 'xyz="0 0 high"'))


MESHES = (
    '<visual><geometry><mesh filename="arm.dae"/></geometry></visual>'
    '<collision><geometry><mesh filename="arm.stl"/></geometry></collision>'
)


@pytest.mark.parametrize(("installed", "shown"), [(True, ["arm.dae"]), (False, ["arm.stl"])])
def test_a_mesh_that_cannot_be_read_here_gives_way_to_the_shape_for_collisions(
    tmp_path, monkeypatch, capsys, installed, shown
):
    monkeypatch.setattr(mesh_file, "find_spec", lambda name: object() if installed else None)
    mesh_file._tell.cache_clear()
    for name in ("arm.dae", "arm.stl"):
        (tmp_path / name).touch()
    urdf = robot([joint("a", "revolute", "base", "link", limit=LIMIT)])
    urdf = urdf.replace('<link name="link">', f'<link name="link">{MESHES}')
    (link,) = [link for link in links_of(urdf, tmp_path) if link.name == "link"]
    assert [shape.file.name for shape in link.shapes] == shown
    assert capsys.readouterr().err.count("pip install pycollada") == (not installed)


def test_a_mesh_that_is_damaged_is_left_out_and_told(tmp_path, capsys):
    pytest.importorskip("trimesh", reason="trimesh comes with viser, which is not installed")
    (tmp_path / "arm.stl").write_bytes(b"solid nothing")
    assert mesh_file.read_mesh(tmp_path / "arm.stl") is None
    assert f"the mesh {tmp_path / 'arm.stl'} is left out" in capsys.readouterr().err
