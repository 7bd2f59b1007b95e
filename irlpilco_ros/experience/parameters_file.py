"""ROS 2 parameter files without ROS: read their keys, and make settings from them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.experience.plain_files import read_yaml
from irlpilco_ros.experience.renamed import under_new_names
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import from_values

SettingsT = TypeVar("SettingsT")


def load_parameters_file(path: Path | str, node_name: str) -> dict[str, Any]:
    """Read the parameters that a node of this name gets from a ROS 2 parameter file.

    Sections apply as in ROS: `/**` first, then `/**/NODE` and `NODE` (also `/NODE`), later ones
    overriding. Nested keys are joined with dots: `policy: {kind: linear}` -> "policy.kind". Old
    names become new ones (see `renamed`), with a warning.

    Raises:
        InvalidSettingError: the file is missing, is not YAML or is no parameter file.
    """
    try:
        document = read_yaml(Path(path))
    except FileError as error:
        raise InvalidSettingError(str(error)) from error
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
        values = content["ros__parameters"] or {}
        if not isinstance(values, dict):
            raise InvalidSettingError(
                f"{path}: 'ros__parameters' of section '{section}' is no map of names and values"
            )
        parameters.update(_flatten(values))
    return under_new_names(parameters, str(path))


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
    own = {
        name.removeprefix(prefix): value
        for name, value in parameters.items()
        if name.startswith(prefix)
    }
    return from_values(cls, own)


def _flatten(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat.update(_flatten(value, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat
