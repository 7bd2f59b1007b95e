"""That the process is to end: asked for by a signal or by a thread, waited for by the main one."""

from __future__ import annotations

import contextlib
import os
import signal
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_THREAD = 0  # no signal's number


class Ending:
    """Waits for SIGINT, SIGTERM, or whoever asks, and misses nobody.

    A signal's handler in Python runs in between any two steps of the main thread. Were that to
    wait for a `threading.Event`, a handler at a step that holds the event's lock would wait for
    it for ever in `set()`: the process could not be ended, and the robot went on. Here whoever
    asks writes to a pipe, for a signal the handler in C that Python has below its own.
    """

    def __init__(self) -> None:
        """Take no signals yet."""
        self._reading, self._writing = os.pipe()
        os.set_blocking(self._writing, False)

    def take_signals(self) -> None:
        """Let SIGINT and SIGTERM ask for the end; to be called in the main thread."""

        def handle(_number: int, _frame: FrameType | None) -> None:
            pass  # it is in the pipe

        signal.set_wakeup_fd(self._writing, warn_on_full_buffer=False)
        for number in _SIGNALS:
            signal.signal(number, handle)

    def ask(self) -> None:
        """Ask for the end, from any thread."""
        with contextlib.suppress(BlockingIOError):  # full of those who asked before
            os.write(self._writing, bytes([_THREAD]))

    def wait(self) -> None:
        """Wait until somebody asks; at once if somebody has."""
        while os.read(self._reading, 1)[0] not in (_THREAD, *_SIGNALS):
            pass
