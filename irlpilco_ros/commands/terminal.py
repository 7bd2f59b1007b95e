"""Progress for people: a bar in a terminal, plain lines in a log."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, TextIO

from tqdm import tqdm

from irlpilco_ros.learning.iteration import Iteration

LINE_INTERVAL = 5.0
"""Seconds between plain progress lines of the same stage [s]."""


class ProgressDisplay:
    """Shows how far something has come, from 0 to 1.

    In a terminal it is a bar that vanishes at the end; otherwise a line is printed when the stage
    changes and then at most every five seconds.
    """

    def __init__(self, title: str, stream: TextIO | None = None) -> None:
        """Show nothing yet.

        Args:
            title: What is going on, such as "iteration 3".
            stream: Where to; sys.stderr unless given, so that results can be piped.
        """
        self._title = title
        self._stream = sys.stderr if stream is None else stream
        self._bar: Any = None
        self._stage = ""
        self._line_time = -LINE_INTERVAL
        if self._stream.isatty():
            self._bar = tqdm(
                total=1.0,
                desc=title,
                leave=False,
                file=self._stream,
                dynamic_ncols=True,
                bar_format="{desc} |{bar}| {percentage:3.0f}% {elapsed}{postfix}",
            )

    def update(self, stage: str, fraction: float, details: str = "") -> None:
        """Show the state: the stage's name, the fraction done of the whole (0..1), and details."""
        if self._bar is not None:
            self._bar.n = min(max(fraction, 0.0), 1.0)
            self._bar.set_description_str(f"{self._title}: {stage}", refresh=False)
            self._bar.set_postfix_str(details)
            return
        now = time.monotonic()
        if stage == self._stage and now - self._line_time < LINE_INTERVAL:
            return
        self._stage, self._line_time = stage, now
        line = f"{self._title}: {stage}, {100 * fraction:.0f} % {details}".rstrip()
        print(line, file=self._stream, flush=True)

    def __enter__(self) -> ProgressDisplay:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()


def print_notes(iteration: Iteration) -> None:
    """Print what a reader should know of an iteration, a line for each note."""
    for note in iteration.notes:
        print(f"iteration {iteration.index}: {note}", flush=True)
