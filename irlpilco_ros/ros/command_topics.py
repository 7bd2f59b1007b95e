"""The topics on which the controller's commands go out."""

from __future__ import annotations

from irlpilco_ros.control.controller_settings import ControllerSettings

JOINT_COMMAND_TOPIC = "joint_command"
"""Where they always go out, and are recorded."""

ALL_OUTPUTS = ControllerSettings(velocity_controller_output=True, joint_trajectory_output=True)
"""Settings by which commands go out everywhere."""


def command_topics(settings: ControllerSettings) -> tuple[str, ...]:
    """Return the names of the topics on which commands go out."""
    return (JOINT_COMMAND_TOPIC, *_named(settings))


def moving_topics(settings: ControllerSettings) -> tuple[str, ...]:
    """Return where somebody must listen: on the outputs that are named, else on joint_command."""
    return _named(settings) or (JOINT_COMMAND_TOPIC,)


def _named(settings: ControllerSettings) -> tuple[str, ...]:
    outputs = {
        "velocity_controller/commands": settings.velocity_controller_output,
        "joint_trajectory_controller/joint_trajectory": settings.joint_trajectory_output,
    }
    return tuple(name for name, wanted in outputs.items() if wanted)
