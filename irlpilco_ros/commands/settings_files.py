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
        InvalidSettingError: a file is no parameter file, a value is wrong, or a file sets what
            does not belong in it.
    """
    robot_path, learning_path = settings_paths(arguments)
    return read_robot_settings(robot_path), read_learning_settings(learning_path)


def read_robot_settings(path: Path) -> RobotSettings:
    """Return the robot of a file, which may hold parameters of other nodes as well.

    Raises:
        InvalidSettingError: it is no parameter file of a robot, or a value is wrong.
    """
    values = load_parameters_file(path, "learner")
    misplaced = sorted(set(values) & set(declarations(LearningSettings)))
    if misplaced:
        raise InvalidSettingError(
            f"{path} sets {', '.join(misplaced)}, which do not belong in the robot's file; give "
            "the learner's settings with --settings"
        )
    return settings_from_parameters(RobotSettings, values)


def read_learning_settings(path: Path) -> LearningSettings:
    """Return the learning settings of a file that holds nothing else.

    Raises:
        InvalidSettingError: it is no parameter file, sets something else, or a value is wrong.
    """
    values = load_parameters_file(path, "learner")
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
    return (
        arguments.robot or config_file("baxter.yaml"),
        arguments.settings or config_file("sweep.yaml"),
    )
