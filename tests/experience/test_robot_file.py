"""A robot's parameters file says what its URDF says, and asks for the rest."""

from __future__ import annotations

import numpy as np
import pytest
from urdf_examples import ARM, LIMIT, TORSO, joint, robot

from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.recorder_settings import RecorderSettings
from irlpilco_ros.experience.robot_file import chosen_joints, robot_file
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.kinematics.urdf_tree import UrdfTree
from irlpilco_ros.learning.errors import InvalidSettingError


def made(urdf, wanted=(), where="robot.urdf"):
    tree = UrdfTree(urdf)
    return robot_file(tree, chosen_joints(tree, wanted), where, "hand")


@pytest.fixture
def read(tmp_path):
    """Return what a node reads from the file made of a URDF."""

    def values(urdf, wanted=()):
        (tmp_path / "robot.urdf").write_text(urdf)
        path = tmp_path / "robot.yaml"
        path.write_text(made(urdf, wanted, str(tmp_path / "robot.urdf")).text)
        return load_parameters_file(path, "learner")

    return values


def test_limits_are_those_of_the_urdf_to_the_last_digit(read):
    settings = settings_from_parameters(RobotSettings, read(ARM))
    assert settings.joints == ("lift", "shoulder", "elbow", "left_finger")
    assert settings.continuous_joints == ("elbow",)
    assert settings.position_lower == (0.0, -1.5707963267948966, -1000.0, 0.0)
    assert settings.position_upper == (0.4, 2.1, 1000.0, 0.04)
    assert settings.velocity_limit == (0.2, 1.5, 2.0, 0.1)
    assert settings.effort_limit == ()  # the lift has none
    assert settings.units == ("m", "rad", "rad", "m")
    assert settings.doubts() == ()


def test_numbers_are_such_that_ros_takes_all_of_a_list_for_doubles(read):
    for name in ("position_lower", "position_upper", "velocity_limit", "effort_limit", "tool_xyz"):
        assert all(isinstance(value, float) for value in read(TORSO)[name]), name


def test_recorder_and_kinematics_take_it_too_without_the_meshes(read):
    values = read(ARM)
    assert settings_from_parameters(RecorderSettings, values).joints[0] == "lift"
    tools = settings_from_parameters(ToolSettings, values)
    assert (tools.tools, tools.tool_links) == (("tool0",), ("tool0",))
    poses = kinematics_of(tools, values["joints"]).poses(np.array([0.1, 0.0, 0.0, 0.0]))
    assert poses.shape == (1, 4, 4)


def test_what_the_urdf_does_not_say_is_held_still_and_asked_for(read):
    urdf = robot(
        [
            joint("a", "revolute", "base", "one", limit='lower="-1" upper="1" effort="3"'),
            joint("b", "revolute", "one", "two", limit='velocity="2" effort="3"'),
            joint("c", "revolute", "two", "three", limit=LIMIT),
        ]
    )
    settings = settings_from_parameters(RobotSettings, read(urdf))
    assert settings.velocity_limit == (0.0, 0.0, 1.0)
    assert settings.effort_limit == (3.0, 3.0, 5.0)
    questions = "\n".join(made(urdf).questions)
    assert "position_upper of b: " in questions
    assert "velocity_limit of a: " in questions
    assert "acceleration_limit: " in questions
    text = " ".join(made(urdf).text.replace("#", " ").split())
    assert all(" ".join(question.split()) in text for question in made(urdf).questions)


def test_a_robot_whose_ros2_control_takes_no_velocities_is_asked_about():
    control = '<ros2_control><joint name="j"><command_interface name="{}"/></joint></ros2_control>'
    arm = [joint("j", "revolute", "base", "link", limit=LIMIT)]
    position = made(robot(arm, more=control.format("position")))
    assert "j: ros2_control in this URDF offers no velocity interface" in position.questions[-1]
    velocity = made(robot(arm, more=control.format("velocity")))
    assert "# velocity_controller_output: true" in velocity.text
    assert len(velocity.questions) == 1


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        ([], ["waist", "left_shoulder", "left_elbow", "left_wrist",
              "right_shoulder", "right_elbow", "right_wrist"]),
        (["right"], ["right_shoulder", "right_elbow", "right_wrist"]),
        (["*_wrist", "waist"], ["left_wrist", "right_wrist", "waist"]),
    ],
)  # fmt: skip
def test_joints_are_chosen_by_name_pattern_or_chain(wanted, names):
    assert [each.name for each in chosen_joints(UrdfTree(TORSO), wanted)] == names


def test_an_unknown_joint_is_refused_with_those_that_are_there():
    with pytest.raises(
        InvalidSettingError, match=r"no joint knee .* chains are waist, left, right"
    ):
        chosen_joints(UrdfTree(TORSO), ["knee"])
    with pytest.raises(InvalidSettingError, match="nothing to learn"):
        chosen_joints(UrdfTree(robot([joint("a", "fixed", "b", "c")])))


def test_names_that_yaml_would_read_otherwise_are_quoted(read):
    names = ["yes", "1", "joint 2", "a: b", "käfer", "No"]
    links = ["base", *(f"l{i}" for i in range(6))]
    joints = [
        joint(name, "revolute", links[i], links[i + 1], limit=LIMIT) for i, name in enumerate(names)
    ]
    assert read(robot(joints))["joints"] == names


def test_tolerances_follow_from_how_far_a_joint_goes(read):
    settings = settings_from_parameters(RobotSettings, read(ARM))
    assert settings.tolerance_share == pytest.approx([0.4, 1.0, 1.0, 0.04])
