"""Settings dataclasses as ROS parameters: declared, described, checked and kept up to date."""

from __future__ import annotations

import typing
from collections.abc import Callable, Iterable
from typing import TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.parameter import Parameter

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import Declaration, declarations, from_values, values_of
from irlpilco_ros.ros.parameter_values import plain
from irlpilco_ros.ros.suite_node import SuiteNode

SettingsT = TypeVar("SettingsT")

_SCALAR_TYPES = {
    bool: Parameter.Type.BOOL,
    int: Parameter.Type.INTEGER,
    float: Parameter.Type.DOUBLE,
    str: Parameter.Type.STRING,
}
_ARRAY_TYPES = {
    bool: Parameter.Type.BOOL_ARRAY,
    int: Parameter.Type.INTEGER_ARRAY,
    float: Parameter.Type.DOUBLE_ARRAY,
    str: Parameter.Type.STRING_ARRAY,
}
_LARGEST_INTEGER = 2**63 - 1
_LARGEST_FLOAT = 1.7976931348623157e308


def declare_settings(
    node: SuiteNode,
    cls: type[SettingsT],
    prefix: str = "",
    apply: Callable[[SettingsT], None] | None = None,
    check: Callable[[SettingsT], None] | None = None,
) -> SettingsT:
    """Declare one parameter per setting, with description, unit, range and choices, and read them.

    Args:
        node: The node that gets the parameters.
        cls: Settings dataclass made with `setting()`.
        prefix: What the parameter names start with, such as "policy.".
        apply: Gets the new settings after a change has been accepted. A change that the class
            refuses is refused with its reason and changes nothing. Without `apply` nothing
            would come of a change, so all parameters are read-only.
        check: Checks new settings against what the class does not know; raises
            InvalidSettingError to refuse them.

    Raises:
        InvalidSettingError: a value given at the start is wrong, or they do not go together.
    """
    declared = declarations(cls)
    kinds = {name: _kind(each) for name, each in declared.items()}
    given = {name: node.given(prefix + name, kind) for name, kind in kinds.items()}
    settings = from_values(cls, {name: each for name, each in given.items() if each is not None})
    if check is not None:
        check(settings)
    for name, value in values_of(settings).items():
        descriptor = _descriptor(declared[name], apply is None)
        node.declare(prefix + name, kinds[name], plain(value), descriptor)
    if apply is not None:
        _follow(node, settings, prefix, apply, check)
    return settings


def updated(settings: SettingsT, parameters: Iterable[Parameter], prefix: str = "") -> SettingsT:
    """Return the settings with those of the parameters that are fields of theirs.

    Raises:
        InvalidSettingError: the outcome is not allowed.
    """
    declared = declarations(type(settings))
    changes = {
        parameter.name.removeprefix(prefix): parameter.value
        for parameter in parameters
        if parameter.name.startswith(prefix) and parameter.name.removeprefix(prefix) in declared
    }
    return from_values(type(settings), {**values_of(settings), **changes})


def _follow(
    node: SuiteNode,
    initial: SettingsT,
    prefix: str,
    apply: Callable[[SettingsT], None],
    check: Callable[[SettingsT], None] | None,
) -> None:
    current = initial

    def judge(parameters: list[Parameter]) -> SetParametersResult:
        try:
            candidate = updated(current, parameters, prefix)
            if check is not None:
                check(candidate)
        except InvalidSettingError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def take_over(parameters: list[Parameter]) -> None:
        nonlocal current
        changed = updated(current, parameters, prefix)
        if changed != current:
            current = changed
            apply(changed)

    node.add_on_set_parameters_callback(judge)
    node.add_post_set_parameters_callback(take_over)


def _kind(declared: Declaration) -> Parameter.Type:
    if typing.get_origin(declared.hint) is tuple:
        return _ARRAY_TYPES[typing.get_args(declared.hint)[0]]
    return _SCALAR_TYPES[declared.hint]


def _descriptor(declared: Declaration, read_only: bool) -> ParameterDescriptor:
    is_array = typing.get_origin(declared.hint) is tuple
    element = typing.get_args(declared.hint)[0] if is_array else declared.hint
    unit = f" [{declared.unit}]" if declared.unit else ""
    descriptor = ParameterDescriptor(
        type=_kind(declared).value,
        description=declared.description + unit,
        read_only=read_only or declared.read_only,
        additional_constraints=_constraints(declared),
    )
    low, high = declared.minimum, declared.maximum
    if is_array or (low is None and high is None):
        return descriptor
    if element is int:
        low = -_LARGEST_INTEGER if low is None else int(low)
        high = _LARGEST_INTEGER if high is None else int(high)
        descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
    elif element is float:
        low = -_LARGEST_FLOAT if low is None else float(low)
        high = _LARGEST_FLOAT if high is None else float(high)
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return descriptor


def _constraints(declared: Declaration) -> str:
    """Say in words what descriptors have no field for: choices, ranges of array elements."""
    words = []
    if declared.choices:
        words.append("one of: " + ", ".join(declared.choices))
    if declared.minimum is not None:
        words.append(f"at least {declared.minimum}")
    if declared.maximum is not None:
        words.append(f"at most {declared.maximum}")
    return "; ".join(words)
