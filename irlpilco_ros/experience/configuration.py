"""config.yaml: what a run was begun with, and whether it is still the same."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError, RunDirectoryError
from irlpilco_ros.experience.motion import MotionSettings
from irlpilco_ros.experience.plain_files import read_yaml
from irlpilco_ros.experience.renamed import under_new_names
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import declarations, from_values, values_of

_ABSENT = "not there"
_NEWER = values_of(MotionSettings(cut_to_motion=False))
"""Settings that runs may have been begun without, and what that meant."""
_WORDS = ("sliding_joints",)
"""Settings that change what is said, and not what is learned."""


def write_configuration(path: Path, configuration: Mapping[str, Any]) -> None:
    """Write a configuration: name -> number, word, list or mapping; numpy's are fine."""
    text = yaml.safe_dump(_plain(configuration), sort_keys=True, default_flow_style=None, width=100)
    write_atomically(path, text.encode())


def read_configuration(path: Path) -> dict[str, Any]:
    """Return a configuration, under the names that its keys have now.

    Raises:
        RunDirectoryError: the file is not there or holds no keys.
    """
    try:
        content = read_yaml(path)
    except FileError as error:
        raise RunDirectoryError(f"{path.parent} is no run directory: {error}") from error
    if not isinstance(content, dict):
        raise RunDirectoryError(f"{path} holds no keys")
    return under_new_names(content)


def motion_settings(configuration: Mapping[str, Any]) -> MotionSettings:
    """Return what counts as motion in a run."""
    return from_values(MotionSettings, {**_NEWER, **configuration})


def differing_keys(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return one phrase for every key that differs: which, what it was and what it is now.

    Settings of extensions (with a dot in their name) come and go with what is installed: one that
    is not there any more had no say. A setting that was not there yet had its default, but for
    cut_to_motion: what runs of before it imitate was not cut.
    """
    old, new = (
        {key: value for key, value in _plain(each).items() if key not in _WORDS}
        for each in (under_new_names(before), now)
    )
    declared = declarations(LearningSettings) | declarations(RobotSettings)
    defaults = {name: each.default for name, each in declared.items()}
    old = {key: value for key, value in old.items() if key in new or "." not in key}
    for key in (key for key in new if key not in old):
        if key in defaults or "." in key:
            old[key] = _plain(_NEWER.get(key, defaults.get(key, new[key])))
    return [
        f"{key} was {old.get(key, _ABSENT)}, now {new.get(key, _ABSENT)}"
        for key in sorted({*old, *new})
        if old.get(key, _ABSENT) != new.get(key, _ABSENT)
    ]


def _plain(value: Any) -> Any:
    """Return the value as YAML gives it back."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, tuple | list) else value
