"""What a URDF says of joints, and what is no URDF."""

from __future__ import annotations

import math

import pytest
from urdf_examples import ARM, LIMIT, TORSO, joint, robot

from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.urdf_tree import UrdfTree


def chains(urdf, names=None):
    tree = UrdfTree(urdf)
    joints = [each for each in tree.joints if names is None or each.name in names]
    return [
        (chain.name, [each.name for each in chain.joints], chain.end)
        for chain in tree.chains(joints)
    ]


def test_limits_are_what_is_written_and_nothing_else():
    lift, shoulder, elbow, finger = UrdfTree(ARM).joints
    assert (lift.limits, lift.velocity, lift.effort, lift.slides) == ((0.0, 0.4), 0.2, None, True)
    assert shoulder.limits == (-math.pi / 2.0, 2.1)
    assert (shoulder.velocity, shoulder.effort, shoulder.slides) == (1.5, 87.0, False)
    assert (elbow.kind, elbow.limits, elbow.velocity) == ("continuous", None, 2.0)
    assert (finger.name, finger.limits) == ("left_finger", (0.0, 0.04))


def test_a_joint_that_follows_another_does_not_move_by_itself():
    assert [each.name for each in UrdfTree(ARM).followers] == ["right_finger"]


def test_a_gripper_is_a_chain_of_its_own_and_the_arm_keeps_its_tool():
    assert chains(ARM) == [
        ("arm", ["lift", "shoulder", "elbow"], "tool0"),
        ("gripper", ["left_finger"], ""),
    ]


def test_where_a_robot_branches_chains_end():
    assert chains(TORSO) == [
        ("waist", ["waist"], ""),
        ("left", ["left_shoulder", "left_elbow", "left_wrist"], "left_hand"),
        ("right", ["right_shoulder", "right_elbow", "right_wrist"], "right_hand"),
    ]


def test_joints_that_are_not_asked_for_are_as_fixed():
    assert chains(TORSO, {"waist", "left_shoulder", "left_wrist"}) == [
        ("arm", ["waist", "left_shoulder", "left_wrist"], "left_hand")
    ]


def test_chains_of_the_same_name_are_told_apart():
    joints = [
        joint(name, "revolute", above, f"{name}_link", limit=LIMIT)
        for arm in ("abc", "def")
        for name, above in zip(arm, ("base", f"{arm[0]}_link", f"{arm[1]}_link"), strict=True)
    ]
    assert [name for name, *_ in chains(robot(joints))] == ["arm", "arm#2"]
    assert [name for name, *_ in chains(robot(joints), {"a", "d"})] == ["a", "d"]


def test_what_ros2_control_offers_is_known():
    control = (
        '<ros2_control name="c" type="system"><joint name="j">'
        '<command_interface name="position"/><command_interface name="velocity"/>'
        "</joint></ros2_control>"
    )
    urdf = robot([joint("j", "revolute", "base", "link", limit=LIMIT)], more=control)
    assert UrdfTree(urdf).joints[0].interfaces == ("position", "velocity")


A = joint("a", "revolute", "base", "link", limit=LIMIT)


@pytest.mark.parametrize(
    ("urdf", "reason"),
    [
        ("", "no XML"),
        ("<mujoco/>", "is a <mujoco>; expected a URDF"),
        (
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>',
            "xacro FILE.xacro > robot.urdf",
        ),
        (robot([A, joint("b", "revolute", "base", "link")]), "link link hangs from two joints"),
        (robot([A, joint("b", "fixed", "c", "d")]), "roots are base, c; expected one"),
        (robot([A, joint("b", "fixed", "link", "base")]), "roots are none"),
        (robot([A]).replace('<link name="base">', '<link name="x">'), "names a link base"),
        (robot([A]).replace('lower="-1"', 'lower="low"'), "lower='low', which is no number"),
        (robot([A]).replace('lower="-1"', 'lower="nan"'), "lower='nan', which is no number"),
        (robot([A]).replace('<child link="link"/>', ""), "joint a has no <child link=...>"),
        (robot([A]).replace('name="a"', 'name="a&#10;b"'), r"'a\\nb'; expected a word"),
    ],
)
def test_what_is_no_tree_of_joints_is_refused_with_the_reason(urdf, reason):
    with pytest.raises(RobotDescriptionError, match=reason):
        UrdfTree(urdf)
