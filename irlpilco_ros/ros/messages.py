"""Small conversions between ROS messages and plain Python."""

from __future__ import annotations

import struct

from builtin_interfaces.msg import Time

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS

_CLOCK_SIZE = 12  # bytes: how it is encoded, seconds, nanoseconds


def nanoseconds(stamp: Time) -> int:
    """Return a message's stamp as whole nanoseconds, exact, so that stamps can be compared."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def time_message(stamp: int) -> Time:
    """Return the stamp [ns] as a message."""
    seconds, rest = divmod(stamp, 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)


def clock_time(data: bytes) -> int:
    """Return the time of a rosgraph_msgs/Clock in CDR bytes [ns].

    Raises:
        BagError: the bytes are no Clock.
    """
    if len(data) < _CLOCK_SIZE:
        raise BagError(f"{len(data)} bytes are no rosgraph_msgs/Clock")
    seconds, rest = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
    return int(seconds) * NANOSECONDS + int(rest)
