"""Settings dataclasses as ROS parameters: declared, described, checked and kept up to date."""

from __future__ import annotations

import typing
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter

from irlpilco_ros.experience.renamed import RENAMED, advice
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import Declaration, declarations, from_values, values_of

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
    node: Node,
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
        InvalidSettingError: the values given at the start do not go together.
    """
    values = {
        name: _declare(node, prefix + name, declared, apply is None)
        for name, declared in declarations(cls).items()
    }
    settings = from_values(cls, values)
    if check is not None:
        check(settings)
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


def given_under_old_name(node: Node, name: str) -> Any:
    """Return what a node was started with under the old name of a parameter, with a warning.

    Returns:
        None if the parameter has no old name, or nothing was given under it.
    """
    for old in (old for old, new in RENAMED.items() if new == name):
        # Declaring is the only public way to what a node was started with.
        node.declare_parameter(old, None, ParameterDescriptor(dynamic_typing=True))
        value = node.get_parameter(old).value
        node.undeclare_parameter(old)
        if value is not None:
            node.get_logger().warning(advice(old))
            return value
    return None


def _declare(node: Node, name: str, declared: Declaration, read_only: bool) -> Any:
    descriptor = _descriptor(declared, read_only)
    default = given_under_old_name(node, name)
    if default is None:
        default = declared.default
    is_empty = isinstance(default, tuple | list) and not default
    # rclpy cannot tell the type of an empty list: declare the type alone then.
    start = Parameter.Type(descriptor.type) if is_empty else default
    node.declare_parameter(name, start, descriptor)
    try:
        return node.get_parameter(name).value
    except ParameterUninitializedException:
        return default


def _follow(
    node: Node,
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


def _descriptor(declared: Declaration, read_only: bool) -> ParameterDescriptor:
    is_array = typing.get_origin(declared.hint) is tuple
    element = typing.get_args(declared.hint)[0] if is_array else declared.hint
    unit = f" [{declared.unit}]" if declared.unit else ""
    descriptor = ParameterDescriptor(
        type=(_ARRAY_TYPES if is_array else _SCALAR_TYPES)[element].value,
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
