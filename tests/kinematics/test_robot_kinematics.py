"""Poses and Jacobians from a URDF."""

from __future__ import annotations

import numpy as np
import pytest
from planar_arm import PLANAR, planar, planar_hand

from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.rigid_motion import difference, pose
from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics
from irlpilco_ros.kinematics.tools import Tool, ToolSettings
from irlpilco_ros.learning.errors import InvalidSettingError, IrlPilcoError

JOINTS = ("joint0", "joint1", "joint2")


def test_poses_are_those_of_trigonometry():
    kinematics = planar()
    for positions in np.random.default_rng(0).uniform(-2.0, 2.0, (10, 3)):
        x, y, direction = planar_hand(positions)
        expected = pose((x, y, 0.0), (0.0, 0.0, direction))
        np.testing.assert_allclose(kinematics.poses(positions)[0], expected, atol=1e-12)


def test_joints_come_in_the_order_that_is_asked_for():
    backwards = RobotKinematics(PLANAR, JOINTS[::-1], planar().tools)
    positions = np.array([0.3, -0.4, 0.9])
    np.testing.assert_array_equal(backwards.poses(positions[::-1]), planar().poses(positions))


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_jacobians_are_those_of_finite_differences(offset):
    kinematics, step = planar(offset), 1e-6
    for positions in np.random.default_rng(1).uniform(-2.0, 2.0, (5, 3)):
        poses, jacobians = kinematics.poses_and_jacobians(positions)
        np.testing.assert_array_equal(poses, kinematics.poses(positions))
        for joint in range(3):
            ahead = kinematics.poses(positions + step * np.eye(3)[joint])
            behind = kinematics.poses(positions - step * np.eye(3)[joint])
            slope = difference(ahead, behind) / (2.0 * step)
            np.testing.assert_allclose(jacobians[..., joint], slope, atol=1e-8)


@pytest.mark.parametrize(
    ("urdf", "words"),
    [
        ("<robot", "no XML"),
        ("<mujoco/>", "expected a URDF"),
        (PLANAR.replace('<child link="link2"/>', ""), "cannot be read"),
        (PLANAR.replace('"joint1"', '"elbow"'), "no joint joint1 .* joint0, elbow, joint2"),
        (PLANAR.replace('"hand"', '"tip"'), "link hand, .* base, link0, link1, link2, tip"),
    ],
)
def test_a_description_that_does_not_fit_is_refused(urdf, words):
    with pytest.raises(RobotDescriptionError, match=words):
        RobotKinematics(urdf, JOINTS, planar().tools)


def settings(**changed) -> ToolSettings:
    values = {"tools": ("pen",), "tool_links": ("hand",), "tool_xyz": (0.1, 0.0, 0.0)}
    return ToolSettings(**{**values, **changed})


def test_settings_name_a_file_and_tools_on_it(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(PLANAR)
    chosen = settings(urdf=str(path), tool_rpy=(0.0, 0.0, -0.5))
    (tool,) = kinematics_of(chosen, JOINTS).poses(np.zeros(3))
    expected = pose((0.9 + 0.1 * np.cos(0.5), 0.1 * np.sin(0.5), 0.0))
    np.testing.assert_allclose(tool, expected, atol=1e-12)


def test_a_file_of_another_package_is_found_where_ros_has_it(tmp_path, monkeypatch):
    share = tmp_path / "share" / "some_arm"
    share.mkdir(parents=True)
    (share / "arm.urdf").write_text(PLANAR)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}")
    found = kinematics_of(settings(urdf="package://some_arm/arm.urdf"), JOINTS)
    assert found.poses(np.zeros(3)).shape == (1, 4, 4)
    with pytest.raises(IrlPilcoError, match="no package other_arm in AMENT_PREFIX_PATH"):
        kinematics_of(settings(urdf="package://other_arm/arm.urdf"), JOINTS)


def test_without_a_file_what_is_told_counts():
    told = kinematics_of(settings(), JOINTS, PLANAR)
    assert told.poses(np.zeros(3)).shape == (1, 4, 4)
    with pytest.raises(RobotDescriptionError, match="robot_description: the robot's description"):
        kinematics_of(settings(), JOINTS, "nothing")
    with pytest.raises(RobotDescriptionError, match=r"none\.urdf cannot be read"):
        kinematics_of(settings(urdf="none.urdf"), JOINTS, PLANAR)


def test_what_is_not_named_or_not_there_is_said(tmp_path):
    with pytest.raises(RobotDescriptionError, match="urdf is not set"):
        kinematics_of(settings(), JOINTS)
    with pytest.raises(RobotDescriptionError, match="tools is empty"):
        kinematics_of(ToolSettings(urdf="arm.urdf"), JOINTS)
    with pytest.raises(RobotDescriptionError, match=r"none\.urdf cannot be read"):
        kinematics_of(settings(urdf=str(tmp_path / "none.urdf")), JOINTS)


@pytest.mark.parametrize(
    "changed",
    [
        {"tools": ("pen", "pen"), "tool_links": ("hand", "hand"), "tool_xyz": (0.0,) * 6},
        {"tool_links": ()},
        {"tool_xyz": (0.0, 0.0)},
        {"tool_rpy": (0.0, 0.0)},
    ],
)
def test_lists_that_do_not_fit_each_other_are_refused(changed):
    with pytest.raises(InvalidSettingError, match="ToolSettings"):
        settings(**changed)


def test_settings_without_angles_are_turned_as_their_links():
    (tool,) = settings().each
    assert (tool.name, tool.link) == ("pen", "hand")
    np.testing.assert_array_equal(tool.offset, Tool("pen", "hand", pose((0.1, 0.0, 0.0))).offset)
