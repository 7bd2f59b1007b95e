"""Pacing of simulated time against the wall clock."""

from __future__ import annotations

import threading
import time

_TOLERATED_DELAY = 0.25  # [s] of wall time that is caught up; more is given up


class Pacemaker:
    """Ends each simulated period when its wall time is over."""

    def __init__(self, period: float, real_time_factor: float, stop: threading.Event) -> None:
        """Start now.

        Args:
            period: Simulated time per beat [s].
            real_time_factor: Simulated seconds per second; 0 waits never.
            stop: Ends a wait at once.
        """
        self._interval = period / real_time_factor if real_time_factor > 0.0 else 0.0
        self._stop = stop
        self._due = time.monotonic()
        self.seconds_lost = 0.0

    def wait(self) -> None:
        """Wait for the end of the present beat; a delay that cannot be caught up is counted."""
        if self._interval == 0.0:
            time.sleep(0.0)
            return
        self._due += self._interval
        remaining = self._due - time.monotonic()
        if remaining > 0.0:
            self._stop.wait(remaining)
        elif remaining < -_TOLERATED_DELAY:
            self.seconds_lost -= remaining
            self._due -= remaining
