"""Settings as frozen dataclasses whose fields carry their description, unit and range.

One declaration serves everybody: the check on construction here, the ROS parameter descriptors
of the nodes, and the keys of a YAML file.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any

from irlpilco_ros.learning.errors import InvalidSettingError


def setting(
    default: Any,
    description: str,
    *,
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] = (),
    read_only: bool = False,
) -> Any:
    """Return a dataclass field that knows what it means.

    Args:
        default: Value if nobody sets it: bool, int, float, str, or a tuple of these.
        description: One sentence for whoever sets it.
        unit: SI unit without brackets, such as "rad/s"; empty if it has none.
        minimum: Smallest allowed value (of each element, for a tuple).
        maximum: Largest allowed value (of each element, for a tuple).
        choices: The allowed words, for a str (or each element of a tuple of str).
        read_only: True if a running node cannot change it.
    """
    metadata = {
        "description": description,
        "unit": unit,
        "minimum": minimum,
        "maximum": maximum,
        "choices": choices,
        "read_only": read_only,
    }
    return dataclasses.field(default=default, metadata=metadata)


def check(settings: Any) -> None:
    """Check every field of a settings dataclass against its type and range.

    Call it from `__post_init__`. Numbers that ROS or YAML hand over as int where a float is
    meant are accepted as they are.

    Raises:
        InvalidSettingError: names the field, what it holds and what was expected.
    """
    for field in dataclasses.fields(settings):
        if "description" not in field.metadata:
            continue
        value = getattr(settings, field.name)
        elements: Iterable[Any] = value if isinstance(value, tuple) else (value,)
        for element in elements:
            _check_element(f"{type(settings).__name__}.{field.name}", element, field.metadata)


def _check_element(name: str, value: Any, metadata: Any) -> None:
    unit = f" [{metadata['unit']}]" if metadata["unit"] else ""
    if metadata["choices"] and value not in metadata["choices"]:
        valid = ", ".join(metadata["choices"])
        raise InvalidSettingError(f"{name} is {value!r}; valid values: {valid}")
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidSettingError(f"{name} is {value}{unit}; expected a finite number")
    minimum, maximum = metadata["minimum"], metadata["maximum"]
    if minimum is not None and value < minimum:
        raise InvalidSettingError(f"{name} is {value}{unit}; expected at least {minimum}{unit}")
    if maximum is not None and value > maximum:
        raise InvalidSettingError(f"{name} is {value}{unit}; expected at most {maximum}{unit}")
