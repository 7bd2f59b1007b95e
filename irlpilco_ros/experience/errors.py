"""What can be wrong with recorded experience."""

from irlpilco_ros.learning.errors import IrlPilcoError


class BagError(IrlPilcoError):
    """A bag is missing, holds something else than expected, or cannot be written."""


class UnreadableBagError(BagError):
    """A bag is not there, is empty or damaged: what was recorded in it cannot be had."""


class IncompleteTrialError(BagError):
    """A bag is readable, but it does not hold a whole trial or demonstration."""


class UnfitDemonstrationError(BagError):
    """A recording is readable, but this robot cannot or should not imitate it."""


class FileError(IrlPilcoError):
    """A file cannot be read or written, or what it holds is none of what was expected."""


class RunDirectoryError(IrlPilcoError):
    """A run directory belongs to another run, is in use, or lacks something."""


class ObjectMovedError(IrlPilcoError):
    """The object of a motion is not where the policy was made for."""
