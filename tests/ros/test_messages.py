"""Conversions between messages and plain Python lose nothing."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.ros.messages import (
    clock_time,
    nanoseconds,
    time_message,
)


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_come_back_to_the_nanosecond(stamp):
    assert nanoseconds(time_message(stamp)) == stamp


@settings(deadline=None)
@given(st.integers(0, 2**31 * 10**9 - 1))
def test_a_clock_is_read_from_its_bytes(time):
    assert clock_time(serialize_message(Clock(clock=time_message(time)))) == time


def test_bytes_that_are_no_clock_are_refused():
    with pytest.raises(BagError, match="5 bytes are no rosgraph_msgs/Clock"):
        clock_time(b"\0\1\0\0\7")
