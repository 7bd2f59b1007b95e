"""Numbers on the command line, and how large they may be."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

from irlpilco_ros.learning.settings import declarations

MOST = 1_000_000
"""The largest count where nothing else bounds it."""

LARGEST_SEED = 2**31 - 1


def whole(minimum: int, maximum: int = MOST) -> Callable[[str], int]:
    """Return what argparse takes as `type`: a whole number from minimum to maximum."""

    def whole_number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = minimum - 1
        if not minimum <= value <= maximum:
            raise argparse.ArgumentTypeError(
                f"{_short(text)} will not do; expected a whole number from {minimum} to {maximum}"
            )
        return value

    return whole_number


def real(minimum: float, maximum: float) -> Callable[[str], float]:
    """Return what argparse takes as `type`: a number from minimum to maximum."""
    return lambda text: _real_number(text, minimum, maximum)


def as_set(settings: type, name: str) -> Callable[[str], float]:
    """Return what argparse takes as `type`: a number in the declared range of a setting.

    Args:
        settings: The dataclass that declares it.
        name: The setting, or list of settings.
    """
    declared = declarations(settings)[name]
    assert declared.minimum is not None
    assert declared.maximum is not None
    return real(declared.minimum, declared.maximum)


def _real_number(text: str, minimum: float, maximum: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and minimum <= value <= maximum):
        raise argparse.ArgumentTypeError(
            f"{_short(text)} will not do; expected a number from {minimum:g} to {maximum:g}"
        )
    return value


def _short(text: str) -> str:
    return repr(text if len(text) <= 30 else f"{text[:27]}...")
