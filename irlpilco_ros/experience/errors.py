"""What can be wrong with recorded experience."""

from irlpilco_ros.learning.errors import IrlPilcoError


class BagError(IrlPilcoError):
    """A bag is missing, holds something else than expected, or cannot be written."""


class IncompleteTrialError(BagError):
    """A bag is readable, but it does not hold a whole trial or demonstration."""


class RunDirectoryError(IrlPilcoError):
    """A run directory belongs to another run, is in use, or lacks something."""
