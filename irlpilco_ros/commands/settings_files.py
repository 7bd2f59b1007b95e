"""Settings of robot and learner from ROS parameter files, for commands that work without ROS."""

from __future__ import annotations

import argparse
from pathlib import Path

from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import declarations
from irlpilco_ros.resources import config_file


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
        InvalidSettingError: a file is no parameter file, a value is wrong, or a learner's
            setting does not exist.
    """
    robot_path, learning_path = settings_paths(arguments)
    robot = load_parameters_file(robot_path, "learner")
    learning = load_parameters_file(learning_path, "learner")
    valid = {*declarations(RobotSettings), *declarations(LearningSettings)}
    unknown = sorted(set(learning) - valid)
    if unknown:
        raise InvalidSettingError(
            f"{learning_path} sets {', '.join(unknown)}, which the learner does not know; "
            f"valid settings: {', '.join(sorted(valid))}"
        )
    values = {**robot, **learning}
    return (
        settings_from_parameters(RobotSettings, values),
        settings_from_parameters(LearningSettings, values),
    )


def settings_paths(arguments: argparse.Namespace) -> tuple[Path, Path]:
    """Return the paths of the robot's and the learner's parameter files."""
    return (
        arguments.robot or config_file("baxter.yaml"),
        arguments.settings or config_file("sweep.yaml"),
    )
