"""The exceptions of this package: one base class, so that a caller can catch them all."""


class IrlPilcoError(Exception):
    """Base of every error that this package raises on purpose.

    A message says what was wrong, where, what was expected and what to do about it.
    """


class InvalidSettingError(IrlPilcoError, ValueError):
    """A setting has the wrong shape, is out of its range or names something that does not exist."""


class NumericalError(IrlPilcoError, ArithmeticError):
    """A computation has no finite answer, even with the safeguards that the caller asked for."""
