"""From what a robot's settings name, or somebody tells, to what its tools are on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.resources import named_file

if TYPE_CHECKING:
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics


def kinematics_of(settings: ToolSettings, joints: Sequence[str], told: str = "") -> RobotKinematics:
    """Return the kinematics of the tools that settings name; this loads MuJoCo.

    Args:
        settings: URDF and tools.
        joints: Names of the robot's joints, in order.
        told: The URDF's text as it was told on the topic robot_description; it counts if the
            settings name none.

    Raises:
        RobotDescriptionError: no URDF or tool is named, or the URDF cannot be read or lacks a
            joint or a link.
    """
    if not (settings.urdf or told) or not settings.tools:
        missing = "tools is empty" if settings.urdf or told else "urdf is not set"
        raise RobotDescriptionError(
            f"where the robot's tools are cannot be told: {missing}; name urdf, tools, tool_links "
            "and tool_xyz in the robot's file, as config/baxter.yaml does (without urdf, what is "
            "told on robot_description counts)"
        )
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics

    text, where = _read(settings.urdf) if settings.urdf else (told, "robot_description")
    try:
        return RobotKinematics(text, joints, settings.each)
    except RobotDescriptionError as error:
        raise RobotDescriptionError(f"{where}: {error}") from error


def _read(urdf: str) -> tuple[str, str]:
    path = named_file(urdf)
    try:
        return path.read_text(encoding="utf-8"), str(path)
    except (OSError, UnicodeDecodeError) as error:
        raise RobotDescriptionError(f"the URDF {path} cannot be read: {error}") from error
