"""/diagnostics of one node (REP-107): at 1 Hz, and at once when the state changes."""

from __future__ import annotations

import threading

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from irlpilco_ros.ros.qos import DIAGNOSTICS

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN
ERROR = DiagnosticStatus.ERROR
STALE = DiagnosticStatus.STALE


class Health:
    """Publishes what a node last reported of itself.

    The timer runs on a steady clock: with `use_sim_time` and no /clock it still tells.
    """

    def __init__(self, node: Node, message: str = "starting") -> None:
        """Start to publish for this node, with a first message."""
        self._node = node
        self._lock = threading.Lock()
        self._status = self._make_status(OK, message, {})
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        self._timer = node.create_timer(
            1.0,
            self._publish,
            callback_group=ReentrantCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    def report(self, level: bytes, message: str, **values: object) -> None:
        """Set the state of the node; published at once if level or message are new.

        Args:
            level: OK, WARN, ERROR or STALE of this module.
            message: One line.
            values: Key -> value, shown beside it.
        """
        status = self._make_status(level, message, values)
        with self._lock:
            before, self._status = self._status, status
        if (before.level, before.message) != (status.level, status.message):
            self._publish()

    def _make_status(
        self, level: bytes, message: str, values: dict[str, object]
    ) -> DiagnosticStatus:
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        name = self._node.get_fully_qualified_name().lstrip("/")
        return DiagnosticStatus(level=level, name=name, message=message, values=pairs)

    def _publish(self) -> None:
        with self._lock:
            message = DiagnosticArray(status=[self._status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
