"""The messages on `controller/reference`: what was shown for each tick of a trial."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.demonstrated import Demonstrated
from irlpilco_ros.ros.messages import time_message


class ReferenceOutput:
    """Tells, tick by tick, where the joints were when the task was shown."""

    def __init__(self, publisher: Publisher, joints: Sequence[str]) -> None:
        """Tell nothing yet.

        Args:
            publisher: Of JointState.
            joints: Names of the joints (J).
        """
        self._publisher = publisher
        self._joints = list(joints)
        self._shown: Demonstrated | None = None
        self._due: tuple[int, int] | None = None

    def begin(self, shown: Demonstrated | None) -> None:
        """Tell this from now on; None for a policy of which nobody knows what it imitates."""
        self._shown, self._due = shown, None

    def note(self, tick: int, stamp: int) -> None:
        """Take note that a tick has come, with its stamp [ns]; `tell` sends it."""
        self._due = tick, stamp

    def tell(self) -> None:
        """Publish what was shown for the tick that has come, if one has."""
        if self._due is None or self._shown is None:
            return
        (tick, stamp), self._due = self._due, None
        if tick >= len(self._shown.positions):
            return  # a trial that is longer than what was shown
        message = JointState(name=self._joints, position=self._shown.positions[tick].tolist())
        message.header.stamp = time_message(stamp)
        self._publisher.publish(message)
