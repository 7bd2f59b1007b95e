"""Numbers on the command line that count something."""

from __future__ import annotations

import argparse
from collections.abc import Callable


def at_least(minimum: int) -> Callable[[str], int]:
    """Return what argparse takes as `type`: a whole number that is not below the minimum."""

    def whole_number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = minimum - 1
        if value < minimum:
            raise argparse.ArgumentTypeError(
                f"{text!r} will not do; expected a whole number, at least {minimum}"
            )
        return value

    return whole_number
