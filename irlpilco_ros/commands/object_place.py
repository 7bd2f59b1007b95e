"""Where the object is, as a command is told."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from irlpilco_ros.experience.adapting import Adapter, AdaptSettings
from irlpilco_ros.experience.object_pose import ObjectSettings, shifted
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import from_values


def add_place_argument(parser: argparse.ArgumentParser, required: bool = False) -> None:
    """Add --object-pose."""
    parser.add_argument(
        "--object-pose",
        type=float,
        nargs=3,
        required=required,
        metavar=("X", "Y", "TURN"),
        help="where the object is now, relative to where it was shown: metres along the base's x "
        "and y, and radians about its own vertical",
    )


def adapter_of(robot_file: Path, robot: Mapping[str, Any], error_limit: float) -> Adapter:
    """Return what adapts a run.

    Args:
        robot_file: Parameters file of the robot, for its tools.
        robot: Values of the robot's settings in the run.
        error_limit: Largest predicted error that is accepted [rad].

    Raises:
        InvalidSettingError: a value is wrong, or the file is none.
    """
    values = load_parameters_file(robot_file, "learner")
    return Adapter(
        from_values(RobotSettings, robot),
        settings_from_parameters(ToolSettings, values),
        settings_from_parameters(ObjectSettings, values),
        AdaptSettings(error_limit),
    )


def moved_to(place: Sequence[float]) -> Callable[[Array], Array]:
    """Return what makes the object's pose now of that in the demonstration."""
    x, y, turn = place
    return lambda before: shifted(before, x, y, turn)
