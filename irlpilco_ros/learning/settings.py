"""Settings as frozen dataclasses whose fields carry their description, unit and range.

One declaration serves everybody: the check on construction here, the ROS parameter descriptors
of the nodes, the keys of a YAML file, and the tables of the documentation. A field made with
`extension_settings()` stands for the settings of all registered extensions, each under the name
`<extension>.<setting>`, as in `rbf.count`.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar

from irlpilco_ros.learning.errors import InvalidSettingError

SettingsT = TypeVar("SettingsT")

Choices = tuple[str, ...] | Callable[[], tuple[str, ...]]
Extensions = Callable[[], Iterable[Any]]

_EXTENSIONS = "extensions"


@dataclass(frozen=True)
class Declaration:
    """One setting as users see it.

    Attributes:
        name: Name of the ROS parameter and YAML key.
        hint: bool, int, float, str, or a tuple of one of these.
        default: Value if nobody sets it.
        description: One sentence for whoever sets it.
        unit: SI unit without brackets; empty if it has none.
        minimum: Smallest allowed value, or None.
        maximum: Largest allowed value, or None.
        choices: The allowed words, as they are known now; empty if any will do.
        read_only: True if a running node cannot change it.
    """

    name: str
    hint: Any
    default: Any
    description: str
    unit: str
    minimum: float | None
    maximum: float | None
    choices: tuple[str, ...]
    read_only: bool


def setting(
    default: Any,
    description: str,
    *,
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    choices: Choices = (),
    read_only: bool = False,
) -> Any:
    """Return a dataclass field that knows what it means.

    Args:
        default: Value if nobody sets it: bool, int, float, str, or a tuple of these.
        description: One sentence for whoever sets it.
        unit: SI unit without brackets, such as "rad/s"; empty if it has none.
        minimum: Smallest allowed value (of each element, for a tuple).
        maximum: Largest allowed value (of each element, for a tuple).
        choices: The allowed words, for a str (or each element of a tuple of str), or a function
            that returns them, such as the names in a registry.
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


def extension_settings(extensions: Extensions) -> Any:
    """Return a dataclass field that maps names of extensions' settings to values.

    Args:
        extensions: Returns the classes whose `Settings` are meant (see `registry.Extension`).
    """
    return dataclasses.field(default_factory=dict, hash=False, metadata={_EXTENSIONS: extensions})


def declarations(cls: type[Any]) -> dict[str, Declaration]:
    """Return every setting of a settings dataclass by its name, those of extensions at the end.

    Raises:
        InvalidSettingError: two extensions declare a setting of the same name.
    """
    declared = {field.name: _declaration(cls, field) for field in _own_fields(cls)}
    mapping = _extensions_field(cls)
    for extension in mapping.metadata[_EXTENSIONS]() if mapping else ():
        for field in _own_fields(extension.Settings):
            name = f"{extension.kind}.{field.name}"
            if name in declared:
                raise InvalidSettingError(f"the setting {name} is declared by two extensions")
            declared[name] = dataclasses.replace(_declaration(extension.Settings, field), name=name)
    return declared


def from_values(cls: type[SettingsT], values: Mapping[str, Any]) -> SettingsT:
    """Return the settings with these values by name; names that are not declared are left out.

    Raises:
        InvalidSettingError: a value has the wrong type or is out of its range.
    """
    mapping = _extensions_field(cls)
    known = {name: value for name, value in values.items() if name in declarations(cls)}
    own = {name: value for name, value in known.items() if "." not in name}
    if mapping:
        own[mapping.name] = {name: value for name, value in known.items() if "." in name}
    return cls(**own)


def values_of(settings: Any) -> dict[str, Any]:
    """Return the value of every setting by its name, also those left at their defaults."""
    mapping = _extensions_field(type(settings))
    given = getattr(settings, mapping.name) if mapping else {}
    return {
        name: given.get(name, declared.default) if "." in name else getattr(settings, name)
        for name, declared in declarations(type(settings)).items()
    }


def check(settings: Any) -> None:
    """Bring every field of a settings dataclass to its declared type, and check its range.

    Call it from `__post_init__`. Lists that YAML hands over become tuples, whole numbers become
    floats where a float is meant.

    Raises:
        InvalidSettingError: names the field, what it holds and what was expected.
    """
    cls = type(settings)
    for field in _own_fields(cls):
        declared = _declaration(cls, field)
        value = _checked(f"{cls.__name__}.{field.name}", getattr(settings, field.name), declared)
        object.__setattr__(settings, field.name, value)
    mapping = _extensions_field(cls)
    if mapping:
        given = _checked_options(cls, mapping, getattr(settings, mapping.name))
        object.__setattr__(settings, mapping.name, given)


def options_of(options: Mapping[str, Any], extension: Any) -> Any:
    """Return the `Settings` of an extension, from the values that are given for it.

    Raises:
        InvalidSettingError: the extension refuses them.
    """
    prefix = f"{extension.kind}."
    own = {name: value for name, value in options.items() if name.startswith(prefix)}
    return extension.Settings(**{name.removeprefix(prefix): own[name] for name in own})


def convert(name: str, value: Any, hint: Any) -> Any:
    """Convert a value of Python, YAML or ROS to the type that a setting is declared with.

    Raises:
        InvalidSettingError: the value cannot be meant as that type.
    """
    if typing.get_origin(hint) is tuple:
        if isinstance(value, str) or not hasattr(value, "__iter__"):
            raise InvalidSettingError(f"{name} is {value!r}; expected a list")
        element = typing.get_args(hint)[0]
        return tuple(convert(name, each, element) for each in value)
    accepted = {float: numbers.Real, int: numbers.Integral}.get(hint, hint)
    if isinstance(value, accepted) and (hint is bool or not isinstance(value, bool)):
        return hint(value)
    raise InvalidSettingError(
        f"{name} is {value!r} ({type(value).__name__}); expected {hint.__name__}"
    )


def _checked(name: str, value: Any, declared: Declaration) -> Any:
    value = convert(name, value, declared.hint)
    for element in value if isinstance(value, tuple) else (value,):
        _check_element(name, element, declared)
    return value


def _check_element(name: str, value: Any, declared: Declaration) -> None:
    unit = f" [{declared.unit}]" if declared.unit else ""
    if declared.choices and value not in declared.choices:
        raise InvalidSettingError(
            f"{name} is {value!r}; valid values: {', '.join(declared.choices)}"
        )
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidSettingError(f"{name} is {value}{unit}; expected a finite number")
    minimum, maximum = declared.minimum, declared.maximum
    if minimum is not None and value < minimum:
        raise InvalidSettingError(f"{name} is {value}{unit}; expected at least {minimum}{unit}")
    if maximum is not None and value > maximum:
        raise InvalidSettingError(f"{name} is {value}{unit}; expected at most {maximum}{unit}")


def _checked_options(
    cls: type[Any], mapping: dataclasses.Field[Any], given: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the values given for extensions, checked, in the order of their names."""
    if not given:
        return {}
    valid = {name: each for name, each in declarations(cls).items() if "." in name}
    unknown = sorted(set(given) - set(valid))
    if unknown:
        raise InvalidSettingError(
            f"{cls.__name__}.{mapping.name} sets {', '.join(unknown)}, which no extension "
            f"declares; valid: {', '.join(valid) or 'none'}"
        )
    checked = {name: _checked(name, given[name], valid[name]) for name in sorted(given)}
    for extension in mapping.metadata[_EXTENSIONS]():
        options_of(checked, extension)  # refused here, not when the extension is first used
    return checked


def _own_fields(cls: type[Any]) -> list[dataclasses.Field[Any]]:
    return [field for field in dataclasses.fields(cls) if "description" in field.metadata]


def _extensions_field(cls: type[Any]) -> dataclasses.Field[Any] | None:
    fields = (field for field in dataclasses.fields(cls) if _EXTENSIONS in field.metadata)
    return next(fields, None)


def _declaration(cls: type[Any], field: dataclasses.Field[Any]) -> Declaration:
    metadata = dict(field.metadata)
    choices: Choices = metadata.pop("choices")
    return Declaration(
        name=field.name,
        hint=_hints(cls)[field.name],  # type: ignore[arg-type]
        default=field.default,
        choices=choices() if callable(choices) else choices,
        **metadata,
    )


@cache
def _hints(cls: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(cls)
