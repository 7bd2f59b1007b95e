"""Conversions between messages and plain Python lose nothing."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.ros.messages import (
    command_values,
    joint_command,
    joint_state,
    nanoseconds,
    time_message,
)


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_come_back_to_the_nanosecond(stamp):
    assert nanoseconds(time_message(stamp)) == stamp


def test_a_joint_state_in_plain_form():
    message = JointState(name=["a", "b"], position=[1.0, 2.0], velocity=[3.0, 4.0])
    message.header.stamp = time_message(1_500_000_000)
    assert joint_state(message) == JointStateMessage(
        1_500_000_000, ("a", "b"), (1.0, 2.0), (3.0, 4.0)
    )


def test_commands_fill_the_field_of_their_interface_and_are_read_from_it():
    velocity = joint_command(5, ("a", "b"), (0.1, 0.2))
    effort = joint_command(5, ("a", "b"), (0.1, 0.2), "effort")
    assert (list(velocity.velocity), list(velocity.effort)) == ([0.1, 0.2], [])
    assert (list(effort.velocity), list(effort.effort)) == ([], [0.1, 0.2])
    for message in (velocity, effort):
        assert nanoseconds(message.header.stamp) == 5
        values = command_values(message, ("b", "c", "a"))
        assert (values[0], values[2]) == (0.2, 0.1)
        assert math.isnan(values[1])
