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

from irlpilco_ros.experience.parameters_file import (
    load_parameters_file,
    settings_from_parameters,
)
from irlpilco_ros.experience.renamed import RENAMED, advice
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import (
    Declaration,
    convert,
    declarations,
    from_values,
    values_of,
)

__all__ = ["declare_settings", "load_parameters_file", "settings_from_parameters", "updated"]

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
    """Declare one parameter per field, with description, unit, range and choices, and read them.

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
    adopt_old_names(node, prefix)
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
    known = declarations(type(settings))
    changes = {
        parameter.name.removeprefix(prefix): parameter.value
        for parameter in parameters
        if parameter.name.startswith(prefix) and parameter.name.removeprefix(prefix) in known
    }
    return from_values(type(settings), {**values_of(settings), **changes})


def adopt_old_names(node: Node, prefix: str = "") -> None:
    """Let values that a node was started with under an old name count under the new one.

    Each is warned of, with the new name (see `experience.renamed`).
    """
    given = node._parameter_overrides  # there is no other way to learn of undeclared ones
    for old in [name for name in given if name.removeprefix(prefix) in RENAMED]:
        new = prefix + RENAMED[old.removeprefix(prefix)]
        value = given.pop(old)
        if new not in given:
            given[new] = Parameter(new, value.type_, value.value)
        node.get_logger().warning(advice(old))


def _declare(node: Node, name: str, declared: Declaration, read_only: bool) -> Any:
    descriptor = _descriptor(declared, read_only)
    is_empty = isinstance(declared.default, tuple) and not declared.default
    # rclpy cannot tell the type of an empty list: declare the type alone then.
    default = Parameter.Type(descriptor.type) if is_empty else declared.default
    node.declare_parameter(name, default, descriptor)
    try:
        value = node.get_parameter(name).value
    except ParameterUninitializedException:
        return declared.default
    return convert(f"parameter {name}", value, declared.hint)


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
