"""From what a robot's settings name to what its tools are on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.resources import named_file

if TYPE_CHECKING:
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics


def kinematics_of(settings: ToolSettings, joints: Sequence[str]) -> RobotKinematics:
    """Return the kinematics of the tools that settings name; this loads MuJoCo.

    Args:
        settings: URDF and tools.
        joints: Names of the robot's joints, in order.

    Raises:
        RobotDescriptionError: no URDF or tool is named, or the URDF cannot be read or lacks a
            joint or a link.
    """
    if not settings.urdf or not settings.tools:
        raise RobotDescriptionError(
            f"where the robot's tools are cannot be told: "
            f"{'tools is empty' if settings.urdf else 'urdf is not set'}; name urdf, tools, "
            "tool_links and tool_xyz in the robot's file, as config/baxter.yaml does"
        )
    path = named_file(settings.urdf)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RobotDescriptionError(f"the URDF {path} cannot be read: {error}") from error
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics

    try:
        return RobotKinematics(text, joints, settings.each)
    except RobotDescriptionError as error:
        raise RobotDescriptionError(f"{path}: {error}") from error
