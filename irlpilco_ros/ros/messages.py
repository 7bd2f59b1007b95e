"""Small conversions between ROS messages and plain Python."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from builtin_interfaces.msg import Time
from sensor_msgs.msg import JointState


def nanoseconds(stamp: Time) -> int:
    """Return a message's stamp as whole nanoseconds, exact, so that stamps can be compared."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def time_message(stamp: int) -> Time:
    """Return the stamp [ns] as a message."""
    seconds, rest = divmod(stamp, 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)


def joint_command(
    stamp: int, names: Sequence[str], values: Iterable[float], interface: str = "velocity"
) -> JointState:
    """Return a joint_command.

    Args:
        stamp: Stamp of the joint state on which the command was decided [ns].
        names: Joints.
        values: One velocity [rad/s] or effort [Nm] per joint.
        interface: "velocity" or "effort".
    """
    message = JointState(name=list(names))
    message.header.stamp = time_message(stamp)
    numbers = [float(value) for value in values]
    if interface == "effort":
        message.effort = numbers
    else:
        message.velocity = numbers
    return message
