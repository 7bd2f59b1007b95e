"""The controller's parameters: policies that it takes, and that it refuses with a reason."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from controlled_robot import CONTROLLER, JOINTS, LONG, MOVING, ROBOT, table
from rcl_interfaces.srv import DescribeParameters, ListParameters

from irlpilco_ros.experience.policy_file import policy_to_parameters
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import LinearPolicy, RbfPolicy

pytestmark = pytest.mark.dds


@pytest.fixture(scope="module")
def graph(shared_ros):
    shared_ros.start(CONTROLLER, parameters=LONG)
    return shared_ros


BAD_POLICIES: dict[str, tuple[dict[str, Any], str]] = {
    "shape": ({"policy.controls": [0.1, 0.2, 0.3]}, "3 values"),
    "finiteness": ({"policy.controls": [0.1, math.nan]}, "expected finite numbers"),
    "limit": ({"policy.control_limit": [1.0, 2.5]}, "expected at most the robot's limit 2"),
    "unknown joint": ({"policy.joints": ["elbow", "hand"]}, "unknown: hand; missing: wrist"),
    "order": ({"policy.joints": ["wrist", "elbow"]}, "in this order: elbow, wrist"),
    "kind": ({"policy.kind": "wild"}, "'wild' is unknown"),
    "a number left out": ({"policy.state_size": None}, "missing: state_size"),
    "absent": ({"policy.controls": None}, "missing: controls"),
    "of another kind": ({"policy.bias": [0.0, 0.0]}, "unknown: bias"),
    "unknown name": ({"policy.wieghts": [0.0]}, "policy.wieghts does not exist"),
    "no band": ({"policy.predicted_positions": [0.1] * 4}, "predicted_deviations has 0 values"),
    "negative band": (
        {"policy.predicted_positions": [0.1] * 4, "policy.predicted_deviations": [-0.1] * 4},
        "predicted_deviations holds a number below 0",
    ),
    "half a demonstration": ({"policy.demonstrated_positions": [0.1] * 3}, "has 3 values"),
    "start outside": ({"start_position": [0.0, 0.99]}, "inside its limits [-1, 1] rad"),
    "start length": ({"start_position": [0.0]}, "1 values for 2 joints"),
}


@pytest.mark.parametrize("case", BAD_POLICIES)
def test_a_bad_policy_is_refused_whole_and_with_its_reason(graph, case):
    good = table([0.05, 0.06])
    assert graph.set_parameters("controller", good).successful
    change, reason = BAD_POLICIES[case]
    policy = {**table([0.7, 0.8]), **change}
    given = {name: value for name, value in policy.items() if value is not None}
    answer = graph.set_parameters("controller", given)
    assert not answer.successful
    assert reason in answer.reason
    assert list(graph.get_parameter("controller", "policy.controls")) == [0.05, 0.06]


def test_a_policy_of_another_kind_leaves_nothing_of_the_one_before(graph):
    assert graph.set_parameters("controller", MOVING).successful
    policy = LinearPolicy(np.zeros((2, 4)), np.zeros(2), np.ones(2))
    linear = policy_to_parameters(policy, Joints(tuple(JOINTS)))
    assert graph.set_parameters("controller", linear).successful
    assert list(graph.get_parameter("controller", "policy.controls")) == []
    assert graph.get_parameter("controller", "policy.state_size") == 0
    # One field of the policy in force can be changed alone, and is checked alike.
    assert graph.set_parameters("controller", {"policy.bias": [0.1, 0.2]}).successful
    assert not graph.set_parameters("controller", {"policy.bias": [0.1]}).successful


def test_a_policy_that_overflows_at_the_start_is_refused(graph):
    assert graph.set_parameters("controller", {**MOVING, "start_position": [0.0, 0.0]}).successful
    centre = np.array([[0.2, 0.1, 0.0, 0.0]])  # anywhere else the distance to it overflows
    widths = np.full((1, 4), -354.0)
    policy = RbfPolicy(centre, np.ones((1, 2)), widths, np.array([1.0, 2.0]))
    steep = policy_to_parameters(policy, Joints(tuple(JOINTS)))
    answer = graph.set_parameters("controller", steep)
    assert not answer.successful
    assert "rbf policy is not finite at its start" in answer.reason
    assert graph.get_parameter("controller", "policy.kind") == "open_loop"
    # The start of the same request is what it is tried at.
    there = {**steep, "start_position": [0.2, 0.1]}
    assert graph.set_parameters("controller", there).successful


def test_every_parameter_says_what_it_means(graph):
    names = graph.call(
        ListParameters, "controller/list_parameters", ListParameters.Request()
    ).result.names
    ours = [name for name in names if not name.startswith(("qos_", "start_type_", "use_sim_"))]
    assert "policy.weights" in ours
    assert "velocity_limit" in ours
    request = DescribeParameters.Request(names=ours)
    answer = graph.call(DescribeParameters, "controller/describe_parameters", request)
    assert [d.name for d in answer.descriptors if not d.description] == []


def test_a_bad_policy_file_ends_the_node_with_one_line(ros):
    parameters = {**ROBOT, **MOVING, "policy.control_limit": [1.0, 3.0]}
    process = ros.start(CONTROLLER, parameters=parameters, wait=False)
    process.expected_code = 1
    assert process.wait() == 1
    assert process.output.startswith("error: policy.control_limit of joint wrist is 3;")
    assert len(process.output.splitlines()) == 1


def test_a_limit_that_bounds_nothing_is_told_or_refused_at_the_start(ros):
    process = ros.start(CONTROLLER, parameters={**ROBOT, "velocity_limit": [1.0, 300.0]})
    ros.wait_for(lambda: "wrist is 300 rad/s, more than" in process.output, "the warning")
    parameters = {**ROBOT, "velocity_limit": [1.0, 1e6]}
    process = ros.start(CONTROLLER, parameters=parameters, wait=False)
    process.expected_code = 1
    assert process.wait() == 1
    assert "velocity_limit is 1000000.0 [rad/s]; expected at most 10000.0" in process.output
