"""Commands that nobody hears: no motion begins, and the answer says what to do."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from controlled_robot import CONTROLLER, JOINTS, MOVING, ROBOT, is_told, trigger_when_heard
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fake_robot import FakeRobot
from other_driver import JOINTS as ARM
from other_driver import START
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.experience.policy_file import write_policy_file
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import OpenLoopPolicy
from irlpilco_ros.ros.endpoint_names import NAMELESS
from irlpilco_ros.ros.qos import COMMAND_RECORDING
from irlpilco_ros.ros.receivers import is_heard_by_name, nobody_listens, receivers

pytestmark = pytest.mark.dds

MOTIONS = ("controller/run_trial", "controller/move_to_start")
STARTING = {**ROBOT, **MOVING, "start_position": [0.0, 0.0]}
WARN = (DiagnosticStatus.WARN,)


def test_a_policy_file_alone_does_not_move_a_robot_of_ros2_control(ros, tmp_path, repository):
    ros.run([sys.executable, str(repository / "tests/other_driver.py")], log="driver.log")
    ros.start("irlpilco_ros.nodes.demonstration_recorder", parameters={"joints": list(ARM)})
    path = tmp_path / "policy_007.yaml"
    policy = OpenLoopPolicy(np.full((4, 6), 0.1), np.ones(6), 12)
    of_robot = {
        "joints": ARM,
        "position_lower": [-3.0] * 6,
        "position_upper": [3.0] * 6,
        "velocity_limit": [1.0] * 6,
        "control_period": 0.1,
        "horizon": 4,
        "start_position": START,
    }
    write_policy_file(path, policy, Joints(ARM), of_robot)
    patience = {"state_timeout": 1.0, "command_timeout": 1.0, "trial_start_tolerance": 1.0}
    alone = ros.start(CONTROLLER, files=[path], parameters=patience)
    heard = ros.listen(DiagnosticArray, "/diagnostics", publishers=1)
    sentence = "nobody listens to the commands, on /joint_command"
    ros.wait_for(lambda: is_told(heard, sentence, WARN), "the recorder's name to be known")
    for motion in MOTIONS:
        answer = trigger_when_heard(ros, motion)
        assert not answer.success
        assert sentence in answer.message
        assert "the robot's own file before the policy's" in answer.message
        assert f"refused: {answer.message}" in alone.output  # whoever watches the node sees why
    alone.stop()
    ros.wait_until_gone("controller")
    output = {"velocity_controller_output": True}
    ros.start(CONTROLLER, files=[path], parameters={**patience, **output})
    answer = trigger_when_heard(ros, "controller/run_trial")
    assert "nobody listens" not in answer.message  # a busy computer may be too late for the trial


def test_a_receiver_that_comes_is_heard_of(ros):
    """Its name has a namespace and is remapped; who only looks on does not count."""
    words = ("-r", "velocity_controller/commands:=wheels/commands")
    output = {"velocity_controller_output": True}
    ros.start(CONTROLLER, *words, parameters={**STARTING, **output}, namespace="/robot")
    heard = ros.listen(DiagnosticArray, "/diagnostics", publishers=1)
    sentence = "nobody listens to the commands, on /robot/wheels/commands"
    with FakeRobot(ros, JOINTS, topic="/robot/", wall_step=0.01) as robot:
        ros.wait_for(lambda: robot.states, "states")
        for motion in MOTIONS:
            answer = trigger_when_heard(ros, f"/robot/{motion}")
            assert not answer.success
            assert sentence in answer.message
            assert "start the robot's driver and the controller of ros2_control" in answer.message
        ros.wait_for(lambda: is_told(heard, sentence, WARN), "a warning")
        assert robot.commands == []
        ros.listen(Float64MultiArray, "/robot/wheels/commands", COMMAND_RECORDING)
        answer = trigger_when_heard(ros, "/robot/controller/run_trial")
        assert "nobody listens" not in answer.message
        assert robot.commands


def test_who_has_no_name_yet_is_waited_for_and_then_believed():
    """A subscription is discovered a tenth of a second before its node's name."""
    nameless = _Graph("_NODE_NAME_UNKNOWN_")
    assert receivers(nameless, ControllerSettings()) == {NAMELESS}
    assert not is_heard_by_name(nameless, ControllerSettings())
    assert not nobody_listens(nameless, ControllerSettings())  # a robot's driver without ROS
    assert is_heard_by_name(_Graph("driver"), ControllerSettings())
    assert not is_heard_by_name(_Graph("demonstration_recorder"), ControllerSettings())


class _Graph:
    """What a node sees of the others: one subscription."""

    def __init__(self, name):
        self._endpoint = TopicEndpointInfo(node_name=name, node_namespace="/")

    def get_name(self):
        return "controller"

    def resolve_topic_name(self, topic):
        return f"/{topic}"

    def get_subscriptions_info_by_topic(self, _topic):
        return [self._endpoint]


def test_who_looks_on_is_no_receiver(ros):
    lookers = [
        Node(name, context=ros.context)
        for name in ("_ros2cli_41", "rosbag2_recorder", "demonstration_recorder")
    ]
    for node in lookers:
        node.create_subscription(JointState, "joint_command", print, 1)
    ros.wait_for(lambda: ros.node.count_subscribers("joint_command") == len(lookers), "them")
    assert receivers(ros.node, ControllerSettings()) == set()
    driver = Node("driver", context=ros.context)
    driver.create_subscription(JointState, "joint_command", print, 1)
    ros.wait_for(lambda: receivers(ros.node, ControllerSettings()) == {"driver"}, "the driver")
    named = ControllerSettings(joint_trajectory_output=True)
    assert receivers(ros.node, named) == set()
    for node in (*lookers, driver):
        node.destroy_node()
