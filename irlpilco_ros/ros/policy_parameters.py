"""The policy as the controller's parameters: all or nothing, refused with a reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from irlpilco_ros.control.safety import check_policy
from irlpilco_ros.experience.policy_file import (
    PREFIX,
    names_parameters,
    parameter_types,
    policy_from_parameters,
)
from irlpilco_ros.experience.renamed import RENAMED, advice
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.ros.parameters import given_under_old_name

_KIND = PREFIX + "kind"
_DESCRIPTIONS = {
    "kind": "Kind of the policy; setting it replaces the whole policy.",
    "joints": "Joints that the policy sees: those of the controller, in the same order.",
    "unactuated_joints": "Those of them that the policy does not move.",
    "continuous_joints": "Those of them that it sees as sine and cosine instead of an angle.",
    "control_limit": "Largest control of each joint, at most the robot's own limit: [rad/s], or "
    "[Nm] ([N] if it slides) for a robot that takes efforts.",
    "horizon": "Number of control periods over which the phase features are spread.",
    "controls": "Controls of each period, row by row: [rad/s], [Nm] or [N].",
    "state_size": "Number of state dimensions: positions and velocities of the joints.",
    "weights": "Gain of each joint's control on each state dimension, row by row.",
    "phase_weights": "Feed-forward of each joint on each phase feature, row by row.",
    "bias": "Constant part of each joint's control before squashing.",
    "centres": "State at which each radial basis function is centred, row by row.",
    "targets": "Value of each joint's control at each centre before squashing, row by row.",
    "log_widths": "Logarithm of the basis functions' width along each state dimension.",
}


class PolicyParameters:
    """Declares `policy.*`, checks every change, and holds the policy in force.

    A change with `policy.kind` in it is a whole new policy: fields that it leaves out are
    emptied, so that the parameters never mix two policies. A change without it alters fields of
    the policy in force.

    Attributes:
        policy: The policy in force, or None as long as none was set.
    """

    def __init__(
        self, node: Node, robot: RobotSettings, on_change: Callable[[Policy], None]
    ) -> None:
        """Declare the parameters and take the policy that the node was started with.

        Args:
            node: The node; it must allow undeclared parameters, so that an unknown name reaches
                the check here and is refused with a reason.
            robot: What the policy must fit.
            on_change: Called with every new policy.

        Raises:
            InvalidSettingError: the node was started with a policy that is none.
        """
        self._node = node
        self._robot = robot
        self._on_change = on_change
        self._types = parameter_types()
        self._values: dict[str, Any] = {}
        for name, kind in self._types.items():
            self._declare(name, kind)
        self.policy = self._make(self._values) if self._values else None
        node.add_pre_set_parameters_callback(self._complete)
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._take_over)

    def _declare(self, name: str, kind: type) -> None:
        descriptor = ParameterDescriptor(description=_DESCRIPTIONS[name.removeprefix(PREFIX)])
        before = given_under_old_name(self._node, name)
        start = _ros_type(name, kind) if before is None else before
        self._node.declare_parameter(name, start, descriptor)
        value = _plain(self._node.get_parameter_or(name).value)
        if _is_given(value):
            self._values[name] = value

    def _complete(self, parameters: list[Parameter]) -> list[Parameter]:
        """Empty the fields that a new policy does not have."""
        given = {parameter.name for parameter in parameters}
        if _KIND not in given:
            return parameters
        return parameters + [
            _empty(name, kind) for name, kind in self._types.items() if name not in given
        ]

    def _judge(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            self._check_names(parameters)
            values = self._merged(parameters)
            if values != self._values:
                self._make(values)
        except InvalidSettingError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take_over(self, parameters: list[Parameter]) -> None:
        values = self._merged(parameters)
        if values != self._values:
            self._values = values
            self.policy = self._make(values)
            self._on_change(self.policy)

    def _check_names(self, parameters: Iterable[Parameter]) -> None:
        for parameter in parameters:
            if not self._node.has_parameter(parameter.name):
                known = ", ".join(self._types)
                hint = f" ({advice(parameter.name)})" if parameter.name in RENAMED else ""
                raise InvalidSettingError(
                    f"parameter {parameter.name} does not exist{hint}; those of a policy are: "
                    f"{known}"
                )

    def _merged(self, parameters: Iterable[Parameter]) -> dict[str, Any]:
        changes = {p.name: _plain(p.value) for p in parameters if p.name in self._types}
        values = {**self._values, **changes}
        return {name: value for name, value in values.items() if _is_given(value)}

    def _make(self, values: dict[str, Any]) -> Policy:
        policy, joints = policy_from_parameters(values)
        check_policy(self._robot, policy, joints)
        return policy


def _ros_type(name: str, kind: type) -> Parameter.Type:
    if kind is list:
        is_names = name in names_parameters()
        return Parameter.Type.STRING_ARRAY if is_names else Parameter.Type.DOUBLE_ARRAY
    types = {str: Parameter.Type.STRING, int: Parameter.Type.INTEGER, float: Parameter.Type.DOUBLE}
    return types[kind]


def _empty(name: str, kind: type) -> Parameter:
    return Parameter(name, _ros_type(name, kind), kind())


def _plain(value: Any) -> Any:
    """Lists, which can be compared, instead of the kinds of array that rclpy hands out."""
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def _is_given(value: Any) -> bool:
    """Empty lists, empty words and zeros stand for fields that a policy does not have."""
    return value is not None and bool(len(value) if hasattr(value, "__len__") else value)
