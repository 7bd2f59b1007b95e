"""Settings as ROS parameters, over DDS: descriptors, refusals with a reason, atomic changes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParameters, SetParametersAtomically

from irlpilco_ros.ros.known_parameters import known_parameters
from irlpilco_ros.ros.policy_parameters import policy_parameters

pytestmark = pytest.mark.dds
MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


def test_the_parameters_of_a_policy_are_known():
    assert set(policy_parameters()) <= known_parameters()


@pytest.fixture(scope="module")
def graph(shared_ros):
    process = shared_ros.run([sys.executable, MINIMAL, "--ros-args", "-p", "limits:=[0.5, 2.0]"])
    shared_ros.wait_for_node("minimal", process)
    return shared_ros


def test_descriptors_tell_meaning_unit_range_and_choices(graph):
    names = ["gain", "count", "mode", "limits", "fixed"]
    request = DescribeParameters.Request(names=names)
    answer = graph.call(DescribeParameters, "minimal/describe_parameters", request)
    gain, count, mode, limits, fixed = answer.descriptors
    assert gain.description == "A gain. [rad/s]"
    span = gain.floating_point_range[0]
    assert (span.from_value, span.to_value) == (0.0, 5.0)
    assert count.integer_range[0].from_value == 1
    assert mode.additional_constraints == "one of: slow, fast"
    assert limits.additional_constraints == "at least 0.0"
    assert fixed.read_only
    assert not gain.read_only


def test_values_of_the_start_arrive(graph):
    assert "limits=(0.5, 2.0)" in graph.trigger("minimal/settings").message


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"gain": 6.0}, "parameter gain is 6.0; expected at least 0.0; at most 5.0"),
        ({"gain": float("nan")}, "parameter gain is nan; expected at least 0.0; at most 5.0"),
        ({"count": 0}, "parameter count is 0; expected at least 1"),
        ({"gain": "high"}, "gain is 'high' (string); expected a number"),
        ({"mode": "loud"}, "valid values: slow, fast"),
        ({"limits": [1.0, -1.0]}, "expected at least 0.0 [rad]"),
        ({"limits": [1.0, float("nan")]}, "expected a finite number"),
        ({"fixed": True}, "fixed is read-only: it is False as long as minimal runs"),
        ({"limit": [1.0]}, "parameter limit does not exist; is limits meant?"),
        ({"zzz": 1}, "those of minimal are: count, dawdling, fixed, gain, limits, mode,"),
    ],
)
def test_a_refused_change_gives_the_reason_and_changes_nothing(graph, change, reason):
    before = graph.trigger("minimal/settings").message
    answer = graph.set_parameters("minimal", {"count": 7, **change})
    assert not answer.successful
    assert reason in answer.reason
    assert graph.trigger("minimal/settings").message == before
    assert graph.get_parameter("minimal", "count") == 3


def test_an_accepted_change_takes_effect(graph):
    assert graph.set_parameters("minimal", {"gain": 4.0, "mode": "fast"}).successful
    settings = graph.trigger("minimal/settings").message
    assert "gain=4.0" in settings
    assert "mode='fast'" in settings


def test_values_are_taken_in_the_type_that_is_meant(graph):
    # As ROS reads the texts 3, 1e-05, [] and [1e-05, 2.0], of which one is no number to YAML 1.1.
    for given, value in ((3, 3.0), ("1e-05", 1e-05)):
        assert graph.set_parameters("minimal", {"gain": given}).successful
        assert graph.get_parameter("minimal", "gain") == value
    for limits, values in (([], []), ("[1e-05, 2.0]", [1e-05, 2.0]), ([1, 2], [1.0, 2.0])):
        assert graph.set_parameters("minimal", {"limits": limits}).successful
        assert list(graph.get_parameter("minimal", "limits")) == values
    # What is fixed may be told again.
    assert graph.set_parameters("minimal", {"fixed": False}).successful


def test_requests_that_make_no_sense_end_no_node(graph):
    wild = ParameterMessage(name="gain", value=ParameterValue(type=200))
    nothing = ParameterMessage(name="gain", value=ParameterValue(type=0))
    for message, reason in ((wild, "no known type (200)"), (nothing, "gain cannot be deleted")):
        request = SetParameters.Request(parameters=[message])
        [result] = graph.call(SetParameters, "minimal/set_parameters", request).results
        assert not result.successful
        assert reason in result.reason
        request = SetParametersAtomically.Request(parameters=[message])
        name = "minimal/set_parameters_atomically"
        assert reason in graph.call(SetParametersAtomically, name, request).result.reason
    assert graph.get_parameter("minimal", "gain") >= 0.0


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["-p", "gian:=2.0"], "no node of irlpilco_ros has: gian (is gain meant?)"),
        (["-p", "metod:=x"], "metod (is imitation meant?)"),
        (["-p", "gain:=high"], "gain is 'high' (string); expected a number"),
        (["-p", "gain:=6.0"], "gain is 6.0 [rad/s]; expected at most 5.0"),
        (["-p", "limits:=nonsense"], "limits is 'nonsense' (string); expected a list of numbers"),
        (["-p", "gain:"], "parameter override rule: '-p gain:'"),
        (["--params-file", "/no/such/file.yaml"], "/no/such/file.yaml"),
    ],
)
def test_a_start_with_a_wrong_parameter_is_refused_in_a_sentence(ros, arguments, reason):
    process = ros.run([sys.executable, MINIMAL, "--ros-args", *arguments])
    process.expected_code = 1
    assert process.wait() == 1
    [line] = [line for line in process.output.splitlines() if line.startswith("error: ")]
    assert reason in line
    assert "Traceback" not in process.output


def test_a_start_takes_parameters_of_other_nodes_of_ros_and_under_old_names(ros):
    given = {
        "gain": 2,
        "limits": [],
        "velocity_limit": [1.0],
        "rbf.count": 3,
        "policy.weights": [1.0],
        "method": "feature_matching",
        "qos_overrides./joint_states.subscription.depth": 3,
    }
    values = [word for name, value in given.items() for word in ("-p", f"{name}:={value}")]
    process = ros.run([sys.executable, MINIMAL, "--ros-args", *values])
    ros.wait_for_node("minimal", process)
    assert "gain=2.0" in ros.trigger("minimal/settings").message
    assert "limits=()" in ros.trigger("minimal/settings").message
