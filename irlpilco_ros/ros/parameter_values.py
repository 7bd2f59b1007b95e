"""Values of ROS parameters as they are meant, whatever way they came.

ROS tells the type of a value from its text. `[]` in a file at the start has none, the same in
`ros2 param load` is a list of bools, and 1e-05 there is a word.
"""

from __future__ import annotations

from typing import Any

from rclpy.parameter import Parameter

from irlpilco_ros.learning.errors import InvalidSettingError

EMPTY: dict[Parameter.Type, Any] = {
    Parameter.Type.BOOL: False,
    Parameter.Type.INTEGER: 0,
    Parameter.Type.DOUBLE: 0.0,
    Parameter.Type.STRING: "",
    Parameter.Type.BOOL_ARRAY: [],
    Parameter.Type.INTEGER_ARRAY: [],
    Parameter.Type.DOUBLE_ARRAY: [],
    Parameter.Type.STRING_ARRAY: [],
}
"""What stands for "nothing" in a parameter of each type, for every parameter has a value."""

_WORDS = {
    Parameter.Type.BOOL: "true or false",
    Parameter.Type.INTEGER: "a whole number",
    Parameter.Type.DOUBLE: "a number",
    Parameter.Type.STRING: "a word; put it into quotation marks if it looks like a number",
    Parameter.Type.BOOL_ARRAY: "a list of true or false",
    Parameter.Type.INTEGER_ARRAY: "a list of whole numbers",
    Parameter.Type.DOUBLE_ARRAY: "a list of numbers",
    Parameter.Type.STRING_ARRAY: "a list of words",
}


def as_declared(given: Parameter, kind: Parameter.Type) -> Parameter:
    """Return a parameter with its value in the type that it is declared with.

    Raises:
        InvalidSettingError: it cannot be meant as that type; says what was expected.
    """
    if given.type_ == kind:
        return Parameter(given.name, kind, plain(given.value))
    try:
        return Parameter(given.name, kind, _converted(given, kind))
    except (TypeError, ValueError) as error:
        raise InvalidSettingError(
            f"{given.name} is {plain(given.value)!r} ({given.type_.name.lower().replace('_', ' ')})"
            f"; expected {_WORDS[kind]}"
        ) from error


def plain(value: Any) -> Any:
    """Return a list, which can be compared, instead of the kinds of array that rclpy hands out."""
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def _converted(given: Parameter, kind: Parameter.Type) -> Any:
    """Return the value in another type; TypeError or ValueError if it cannot be meant."""
    value, of = given.value, given.type_
    if EMPTY[kind] == [] and of.name.endswith("ARRAY") and len(value) == 0:
        return []
    if kind == Parameter.Type.DOUBLE and of in {
        Parameter.Type.INTEGER,
        Parameter.Type.STRING,
    }:
        return float(value)
    if kind == Parameter.Type.DOUBLE_ARRAY:
        if of == Parameter.Type.STRING and value.startswith("[") and value.endswith("]"):
            return [float(each) for each in value[1:-1].split(",")]
        if of in {Parameter.Type.INTEGER_ARRAY, Parameter.Type.STRING_ARRAY}:
            return [float(each) for each in value]
    raise TypeError
