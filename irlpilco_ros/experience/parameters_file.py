"""ROS 2 parameter files without ROS: read their keys, and make settings from them."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml

from irlpilco_ros.learning.errors import InvalidSettingError

SettingsT = TypeVar("SettingsT")


def load_parameters_file(path: Path | str, node_name: str) -> dict[str, Any]:
    """Read the parameters that a node of this name gets from a ROS 2 parameter file.

    Sections apply as in ROS: `/**` first, then `/**/NODE` and `NODE` (also `/NODE`), later ones
    overriding. Nested keys are joined with dots: `policy: {kind: linear}` -> "policy.kind".

    Raises:
        InvalidSettingError: the file is missing, is not YAML or is no parameter file.
    """
    try:
        document = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidSettingError(f"cannot read the parameter file {path}: {error}") from error
    except yaml.YAMLError as error:
        raise InvalidSettingError(f"{path} is not valid YAML: {error}") from error
    if not isinstance(document, dict):
        raise InvalidSettingError(
            f"{path} is no ROS parameter file; expected 'NODE:' or '/**:' and below it "
            "'ros__parameters:'"
        )
    parameters: dict[str, Any] = {}
    for section in ("/**", f"/**/{node_name}", f"/{node_name}", node_name):
        content = document.get(section)
        if content is None:
            continue
        if not isinstance(content, dict) or "ros__parameters" not in content:
            raise InvalidSettingError(f"{path}: section '{section}' lacks 'ros__parameters:'")
        parameters.update(_flatten(content["ros__parameters"] or {}))
    return parameters


def settings_from_parameters(
    cls: type[SettingsT], parameters: Mapping[str, Any], prefix: str = ""
) -> SettingsT:
    """Make a settings dataclass from ROS parameters; keys that are not its fields are left out.

    Args:
        cls: Settings dataclass made with `setting()`.
        parameters: Name -> value; lists become tuples, whole numbers become floats where a
            float is meant.
        prefix: What the parameter names start with, such as "policy.".

    Raises:
        InvalidSettingError: a value has the wrong type or is out of its range.
    """
    hints = typing.get_type_hints(cls)
    values = {
        field.name: convert(prefix + field.name, parameters[prefix + field.name], hints[field.name])
        for field in dataclasses.fields(cls)  # type: ignore[arg-type]
        if prefix + field.name in parameters
    }
    return cls(**values)


def convert(name: str, value: Any, hint: Any) -> Any:
    """Convert a YAML or ROS value to the annotated type of a settings field.

    Raises:
        InvalidSettingError: the value cannot be meant as that type.
    """
    if typing.get_origin(hint) is tuple:
        if isinstance(value, str) or not hasattr(value, "__iter__"):
            raise InvalidSettingError(f"parameter {name} is {value!r}; expected a list")
        element_hint = typing.get_args(hint)[0]
        return tuple(convert(name, element, element_hint) for element in value)
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if hint in (bool, int, str) and type(value) is hint:
        return value
    raise InvalidSettingError(
        f"parameter {name} is {value!r} ({type(value).__name__}); expected {hint.__name__}"
    )


def _flatten(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat.update(_flatten(value, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat
