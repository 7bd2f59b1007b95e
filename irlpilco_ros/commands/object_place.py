"""Where the object is, as a command is told."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.number_options import as_set, real
from irlpilco_ros.experience.adapting import Adapter, AdaptSettings
from irlpilco_ros.experience.object_pose import ObjectSettings, shifted
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import from_values


def add_place_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --object-pose and --speed."""
    parser.add_argument(
        "--object-pose",
        type=real(-100.0, 100.0),
        nargs=3,
        metavar=("X", "Y", "TURN"),
        help="where the object is now, relative to where it was shown: metres along the base's x "
        "and y, and radians about its own vertical (default: where the run is)",
    )
    parser.add_argument(
        "--speed",
        type=as_set(AdaptSettings, "speed"),
        metavar="S",
        help="how many times as fast as it was shown: from 0.5 to 1.5 (default: 1)",
    )


def adapter_of(robot_file: Path, robot: Mapping[str, Any], accepted: AdaptSettings) -> Adapter:
    """Return what adapts a run.

    Args:
        robot_file: Parameters file of the robot, for its tools.
        robot: Values of the robot's settings in the run.
        accepted: How fast it is to be, and what is accepted.

    Raises:
        InvalidSettingError: a value is wrong, or the file is none.
    """
    values = load_parameters_file(robot_file, "learner")
    tools = settings_from_parameters(ToolSettings, values)
    return Adapter(
        dataclasses.replace(from_values(RobotSettings, robot), tools=tools),
        tools,
        settings_from_parameters(ObjectSettings, values),
        accepted,
    )


def settings_of(arguments: argparse.Namespace, **values: Any) -> AdaptSettings:
    """Return what is asked for by --speed, with other values of the settings.

    Raises:
        InvalidSettingError: the speed is out of its range.
    """
    speed = {} if arguments.speed is None else {"speed": arguments.speed}
    return AdaptSettings(**values, **speed)


def moved_to(place: Sequence[float] | None) -> Callable[[Array], Array] | None:
    """Return what makes the object's pose now of that in the demonstration; None if it stayed."""
    if place is None:
        return None
    x, y, turn = place
    return lambda before: shifted(before, x, y, turn)
