"""Messages on `joint_command` for tests, as a controller sends them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sensor_msgs.msg import JointState

from irlpilco_ros.ros.messages import time_message


def joint_command(
    stamp: int, names: Sequence[str], values: Iterable[float], interface: str = "velocity"
) -> JointState:
    """Return the command of joints that was decided on the joint state of this stamp [ns]."""
    message = JointState(name=list(names))
    message.header.stamp = time_message(stamp)
    setattr(message, interface, [float(value) for value in values])
    return message
