"""A parameter for one use: it is empty again after that, or when its use did not come."""

from __future__ import annotations

from rclpy.clock import Clock, ClockType
from rclpy.parameter import Parameter

from irlpilco_ros.ros.suite_node import SuiteNode


class PassingParameter:
    """A text parameter that whoever sets it need not set back, and so may die after setting it."""

    def __init__(self, node: SuiteNode, name: str, patience: float) -> None:
        """Look after a parameter that the node has declared.

        Args:
            node: Whose parameter it is.
            name: Its name.
            patience: How long a value waits for its use [s], on the steady clock.
        """
        self._node = node
        self._name = name
        self._timer = node.create_timer(
            patience, self.clear, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        node.add_post_set_parameters_callback(self._on_set)
        if not node.get_parameter(name).value:
            self._timer.cancel()

    def _on_set(self, parameters: list[Parameter]) -> None:
        """Begin to wait, anew for each value that is set."""
        if any(each.name == self._name and each.value for each in parameters):
            self._timer.reset()

    def clear(self) -> None:
        """Empty it: it was used, or not in time."""
        self._timer.cancel()
        self._node.set_parameters([Parameter(self._name, value="")])
