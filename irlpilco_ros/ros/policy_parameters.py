"""The policy as the controller's parameters: all or nothing, refused with a reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.parameter import Parameter

from irlpilco_ros.control.safety import check_policy
from irlpilco_ros.experience.demonstrated import Demonstrated
from irlpilco_ros.experience.policy_file import (
    BESIDE,
    HISTORY,
    PREFIX,
    policy_fields,
    policy_from_parameters,
)
from irlpilco_ros.experience.predicted_band import PredictedBand
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.policies import REGISTRY, Policy
from irlpilco_ros.learning.policies.declaration import declared
from irlpilco_ros.ros.parameter_values import EMPTY, plain
from irlpilco_ros.ros.suite_node import SuiteNode

_KIND = PREFIX + "kind"
_START = "start_position"  # a parameter of the controller's own
_TEXTS = {
    _KIND: "Kind of the policy; setting it replaces the whole policy.",
    PREFIX + "joints": "Joints that the policy sees: those of the controller, in the same order.",
    PREFIX + "unactuated_joints": "Those of them that the policy does not move.",
    PREFIX + "continuous_joints": "Those of them that it sees as sine and cosine of their angle.",
}
_BESIDE_TEXTS = (
    "What the model expects of the trial: positions of `policy.joints` at its ticks, from 0 on "
    "[rad]; empty where nothing was predicted. See guard_sigma.",
    "Their standard deviations [rad].",
    "What the policy imitates: positions of `policy.joints` at the ticks of a trial, from 0 on "
    "[rad]; empty where nobody knows. Told on controller/reference, and nothing else.",
)
_SCALARS = {int: Parameter.Type.INTEGER, float: Parameter.Type.DOUBLE}


def policy_parameters() -> dict[str, ParameterDescriptor]:
    """Return the descriptor of every parameter that a policy of any kind can have, by name."""
    found = {}
    for name, text in _TEXTS.items():
        kind = Parameter.Type.STRING if name == _KIND else Parameter.Type.STRING_ARRAY
        found[name] = ParameterDescriptor(name=name, type=kind.value, description=text)
    for name, text in zip(BESIDE, _BESIDE_TEXTS, strict=True):
        kind = Parameter.Type.DOUBLE_ARRAY
        found[name] = ParameterDescriptor(name=name, type=kind.value, description=text)
    found[PREFIX + HISTORY] = ParameterDescriptor(
        name=PREFIX + HISTORY,
        type=Parameter.Type.INTEGER.value,
        description="Number of its last commands that the policy sees beside the joints.",
    )
    for name, field in policy_fields().items():
        kind = Parameter.Type.DOUBLE_ARRAY if field.shape else _SCALARS[field.kind]
        unit = f" [{field.unit}]" if field.unit else ""
        shape = f" Shape: {' x '.join(field.shape)}." if field.shape else ""
        found[name] = ParameterDescriptor(
            name=name, type=kind.value, description=field.description + unit + shape
        )
    return found


class PolicyParameters:
    """Declares `policy.*`, checks every change, and holds the policy in force.

    A change with `policy.kind` in it is a whole new policy: fields that it leaves out are
    emptied, so that the parameters never mix two policies. A change without it alters fields of
    the policy in force. A request that sets parameters one by one, as `ros2 param load` does, is
    taken for one change of the policy and the start.

    Attributes:
        policy: The policy in force, or None as long as none was set.
    """

    def __init__(
        self, node: SuiteNode, robot: RobotSettings, on_change: Callable[[Policy | None], None]
    ) -> None:
        """Declare the parameters and take the policy that the node was started with.

        Args:
            node: The node; it has declared `start_position`.
            robot: What the policy must fit.
            on_change: Called with every new policy.

        Raises:
            InvalidSettingError: the node was started with a policy that is none.
        """
        self._node = node
        self._robot = robot
        self._on_change = on_change
        self._descriptors = policy_parameters()
        given = {
            name: node.given(name, Parameter.Type(descriptor.type))
            for name, descriptor in self._descriptors.items()
        }
        self._values = {name: value for name, value in given.items() if value is not None}
        self.policy = self._make(self._values, ())
        for name, descriptor in self._descriptors.items():
            kind = Parameter.Type(descriptor.type)
            node.declare(name, kind, self._values.get(name, EMPTY[kind]), descriptor)
        node.keep_together([*self._descriptors, _START])
        node.add_pre_set_parameters_callback(self._complete)
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._take_over)

    @property
    def band(self) -> PredictedBand | None:
        """What was predicted of the policy's trial; None if nothing was."""
        return (
            None
            if self.policy is None
            else PredictedBand.from_parameters(self._values, self._robot.roles)
        )

    @property
    def demonstrated(self) -> Demonstrated | None:
        """What the policy imitates; None if nobody knows."""
        return (
            None
            if self.policy is None
            else Demonstrated.from_parameters(self._values, self._robot.roles)
        )

    def _complete(self, parameters: list[Parameter]) -> list[Parameter]:
        """Empty the fields that a new policy does not have."""
        given = {parameter.name for parameter in parameters}
        if _KIND not in given:
            return parameters
        return parameters + [
            _Emptied(descriptor)
            for name, descriptor in self._descriptors.items()
            if name not in given
        ]

    def _judge(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            values = self._merged(parameters)
            if values != self._values:
                self._make(values, parameters)
        except InvalidSettingError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take_over(self, parameters: list[Parameter]) -> None:
        values = self._merged(parameters)
        if values != self._values:
            self._values = values
            self.policy = self._make(values, parameters)
            self._on_change(self.policy)

    def _merged(self, parameters: Iterable[Parameter]) -> dict[str, Any]:
        changes = {
            p.name: None if isinstance(p, _Emptied) else plain(p.value)
            for p in parameters
            if p.name in self._descriptors
        }
        values = {**self._values, **changes}
        return {name: value for name, value in values.items() if value is not None}

    def _make(self, values: dict[str, Any], parameters: Iterable[Parameter]) -> Policy | None:
        """Return the policy of these values, tried at the start that the same request may set."""
        if not any(values.values()):
            return None  # saved from a controller that had none
        if not values.get(_KIND):
            raise InvalidSettingError(
                f"{_KIND} is missing or empty, and there is no policy that could be altered; a "
                "policy is set whole, in one request: ros2 param load NODE policy_007.yaml"
            )
        policy, joints = policy_from_parameters(_given(values))
        PredictedBand.from_parameters(values, joints)  # refuses what is no band
        Demonstrated.from_parameters(values, joints)
        start = self._node.get_parameter(_START).value
        start = next((p.value for p in parameters if p.name == _START), start)
        check_policy(self._robot, policy, joints, tuple(start))
        return policy


class _Emptied(Parameter):  # type: ignore[misc]
    """A field that a new policy leaves out; ROS parameters cannot be taken back."""

    def __init__(self, descriptor: ParameterDescriptor) -> None:
        kind = Parameter.Type(descriptor.type)
        super().__init__(descriptor.name, kind, EMPTY[kind])


def _given(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that say something.

    In parameters that were saved from a running controller, an empty list or word, or a zero,
    stands for a field that the policy does not have. Where the kind has the field, a zero is a
    zero.
    """
    kind = values.get(_KIND)
    known = REGISTRY.names()
    own = {PREFIX + field.name for field in declared(REGISTRY.get(kind))} if kind in known else ()
    return {
        name: value
        for name, value in values.items()
        if value or (name in own and not isinstance(value, list | str))
    }
