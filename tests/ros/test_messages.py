"""Conversions between messages and plain Python lose nothing."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.ros.messages import (
    joint_command,
    nanoseconds,
    time_message,
)


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_come_back_to_the_nanosecond(stamp):
    assert nanoseconds(time_message(stamp)) == stamp


def test_commands_fill_the_field_of_their_interface():
    velocity = joint_command(5, ("a", "b"), (0.1, 0.2))
    effort = joint_command(5, ("a", "b"), (0.1, 0.2), "effort")
    assert (list(velocity.velocity), list(velocity.effort)) == ([0.1, 0.2], [])
    assert (list(effort.velocity), list(effort.effort)) == ([], [0.1, 0.2])
    for message in (velocity, effort):
        assert nanoseconds(message.header.stamp) == 5
