"""Times of the wall clock that go on when somebody sets it."""

from __future__ import annotations

import time


class RunningClock:
    """The wall clock as it was when recording began, and the steady clock from there on."""

    def __init__(self) -> None:
        """Begin now."""
        self._wall, self._steady = time.time_ns(), time.monotonic_ns()

    def mended(self, received: int) -> int:
        """Return when a message came [ns], as if the wall clock had never been set.

        Args:
            received: When it came [ns] by the wall clock, before or after it was set.
        """
        now = self._wall + time.monotonic_ns() - self._steady
        shift = time.time_ns() - now
        return min(received, received - shift, key=lambda moment: abs(moment - now))
