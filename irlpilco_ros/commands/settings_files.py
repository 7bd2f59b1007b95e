"""Settings of robot and learner from ROS parameter files, for commands that work without ROS."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings, robot_from_parameters
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import REGISTRY
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import declarations
from irlpilco_ros.resources import config_file

MISCALIBRATED = "miscalibrated"
"""What the demo takes instead of a robot's file: Baxter with joints that are off."""


def add_settings_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --settings and --robot."""
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="parameters file of the learner (default: the package's config/sweep.yaml)",
    )
    parser.add_argument(
        "--robot",
        type=Path,
        metavar="FILE",
        help="parameters file of the robot (default: the package's config/baxter.yaml)",
    )


def read_settings(arguments: argparse.Namespace) -> tuple[RobotSettings, LearningSettings]:
    """Return robot and learning settings of the files given, or of the package's own.

    Raises:
        InvalidSettingError: a file is no parameter file, a value is wrong, or a file sets what
            does not belong in it.
    """
    robot_path, learning_path = settings_paths(arguments)
    chosen = {**_pace(learning_path), **_pace_asked_for(arguments)}
    return read_robot_settings(robot_path, chosen), read_learning_settings(learning_path)


def pace_sentence(arguments: argparse.Namespace, robot: RobotSettings) -> str:
    """Say at which pace a robot is taught, and which of the files given says so."""
    robot_path, learning_path = settings_paths(arguments)
    told = {
        learning_path: _pace(learning_path),
        robot_path: load_parameters_file(robot_path, "learner"),
    }
    sources = (str(path) for path, values in told.items() if "control_period" in values)
    return f"pace: control_period is {robot.control_period:g} s ({next(sources, 'the default')})"


def _pace(path: Path) -> dict[str, Any]:
    """Return what a learner's file says of how the robot is taught, and not what it is."""
    values = load_parameters_file(path, "learner")
    return {name: values[name] for name in _teaching() if name in values}


def _pace_asked_for(arguments: argparse.Namespace) -> dict[str, Any]:
    period = getattr(arguments, "control_period", None)
    return {} if period is None else {"control_period": period}


def _teaching() -> set[str]:
    """Return the names of a robot's settings that a learner's file may hold, and that count then.

    They are parameters of the learner, which hands to the controller what it needs of them.
    """
    names = (name.partition(".") for name in declarations(RobotSettings))
    features = {"".join(parts) for parts in names if parts[1] and parts[0] in REGISTRY.names()}
    return {"control_period", "horizon", "features", *features}


def read_robot_settings(path: Path, chosen: Mapping[str, Any] | None = None) -> RobotSettings:
    """Return the robot of a file, which may hold parameters of other nodes as well.

    Args:
        path: The file.
        chosen: Values that count instead of the file's.

    Raises:
        InvalidSettingError: it is no parameter file of a robot, or a value is wrong.
    """
    values = {**load_parameters_file(path, "learner"), **(chosen or {})}
    misplaced = sorted(set(values) & set(declarations(LearningSettings)))
    if misplaced:
        raise InvalidSettingError(
            f"{path} sets {', '.join(misplaced)}, which do not belong in the robot's file; give "
            "the learner's settings with --settings"
        )
    return robot_from_parameters(values)


def read_learning_settings(path: Path) -> LearningSettings:
    """Return the learning settings of a file; the robot's pace may stand in it as well.

    Raises:
        InvalidSettingError: it is no parameter file, sets something else, or a value is wrong.
    """
    values = load_parameters_file(path, "learner")
    values = {name: value for name, value in values.items() if name not in _teaching()}
    valid = set(declarations(LearningSettings))
    wrong = sorted(set(values) - valid)
    if not wrong:
        return settings_from_parameters(LearningSettings, values)
    robot = set(wrong) & set(declarations(RobotSettings))
    advice = "give the robot's settings with --robot; " if robot else ""
    raise InvalidSettingError(
        f"{path} sets {', '.join(wrong)}, which do not belong in the learner's settings; {advice}"
        f"valid settings: {', '.join(sorted(valid))}"
    )


def settings_paths(arguments: argparse.Namespace) -> tuple[Path, Path]:
    """Return the paths of the robot's and the learner's parameter files."""
    named = arguments.robot is None or str(arguments.robot) == MISCALIBRATED
    return (
        config_file("baxter.yaml") if named else arguments.robot,
        arguments.settings or config_file("sweep.yaml"),
    )
