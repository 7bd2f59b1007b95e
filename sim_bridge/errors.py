"""What can go wrong in the simulation."""

from irlpilco_ros.learning.errors import IrlPilcoError


class InvalidCommandError(IrlPilcoError, ValueError):
    """A command names an unknown joint, has the wrong length or holds a number that is not finite.

    The robot does not move for it.
    """


class RenderingError(IrlPilcoError, RuntimeError):
    """No picture can be drawn on this machine; the message says what to install."""


class ApproachError(IrlPilcoError, RuntimeError):
    """The arms did not reach a position in time; the message names the joint that is furthest."""


class DivergedError(IrlPilcoError, ArithmeticError):
    """The physics has no finite answer any more; only a reset helps."""
