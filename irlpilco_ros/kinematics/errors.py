"""What can be wrong with a robot's description, and with places that its tools are to reach."""

from irlpilco_ros.learning.errors import IrlPilcoError


class RobotDescriptionError(IrlPilcoError):
    """A URDF cannot be read, or lacks a joint or a link."""


class UnreachableError(IrlPilcoError):
    """Tools cannot be where they have to be: too far, beyond a joint's limit, or too fast."""
