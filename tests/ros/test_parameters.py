"""Settings as ROS parameters, over DDS: descriptors, refusals with a reason, atomic changes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from rcl_interfaces.srv import DescribeParameters

pytestmark = pytest.mark.dds
MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


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
        ({"gain": 6.0}, "out of range"),
        ({"gain": 3}, "Wrong parameter type"),
        ({"mode": "loud"}, "valid values: slow, fast"),
        ({"limits": [1.0, -1.0]}, "expected at least 0.0 [rad]"),
        ({"limits": [1.0, float("nan")]}, "expected a finite number"),
        ({"fixed": True}, "read-only"),
    ],
)
def test_a_refused_change_gives_the_reason_and_changes_nothing(graph, change, reason):
    before = graph.trigger("minimal/settings").message
    answer = graph.set_parameters("minimal", {"count": 7, **change})
    assert not answer.successful
    assert reason in answer.reason
    assert graph.trigger("minimal/settings").message == before
    assert graph.get_parameter("minimal", "count") != 7


def test_an_accepted_change_takes_effect(graph):
    assert graph.set_parameters("minimal", {"gain": 4.0, "mode": "fast"}).successful
    settings = graph.trigger("minimal/settings").message
    assert "gain=4.0" in settings
    assert "mode='fast'" in settings
