"""The message on `learner/progress`: how far the iteration under way has come."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, fields

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from irlpilco_ros.learning.errors import IrlPilcoError


class MalformedProgressError(IrlPilcoError, ValueError):
    """A message on `learner/progress` is none of a learner's."""


STATUS_NAME = "learner: progress"
"""Name of the one status in the message."""


@dataclass(frozen=True)
class LearnerProgress:
    """Where the learner is.

    Attributes:
        stage: What it is doing, such as "model", "policy" or "trial"; "idle" if nothing.
        iteration: Which iteration, or -1 if none is under way.
        fraction: How much of the iteration is done, 0..1.
        cost: Lowest cost found so far, NaN if there is none.
        evaluations: Cost evaluations so far.
        seconds_left: Estimated computing time left [s], NaN if unknown.
    """

    stage: str = "idle"
    iteration: int = -1
    fraction: float = 0.0
    cost: float = math.nan
    evaluations: int = 0
    seconds_left: float = math.nan

    def to_message(self, stamp: Time) -> DiagnosticArray:
        """Return the message, stamped."""
        values = [KeyValue(key=f.name, value=str(getattr(self, f.name))) for f in fields(self)]
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK, name=STATUS_NAME, message=self.stage, values=values
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = stamp
        return message

    @staticmethod
    def from_message(message: DiagnosticArray) -> LearnerProgress | None:
        """Return the progress in a message, or None if it has none.

        Raises:
            MalformedProgressError: a value is missing, or is nothing that a learner says.
        """
        for status in message.status:
            if status.name == STATUS_NAME:
                values = {item.key: item.value for item in status.values}
                try:
                    return _read(values)
                except (KeyError, ValueError) as error:
                    raise MalformedProgressError(
                        f"a learner's progress cannot be made of {values}: {error!r}"
                    ) from error
        return None

    def details(self) -> str:
        """Return cost, evaluations and time left as a short text, as far as they are known."""
        parts = []
        if not math.isnan(self.cost):
            parts.append(f"cost {self.cost:.4g}")
        if self.evaluations:
            parts.append(f"{self.evaluations} evaluations")
        if not math.isnan(self.seconds_left):
            parts.append(f"{self.seconds_left:.0f} s left")
        return ", ".join(parts)


def _read(values: Mapping[str, str]) -> LearnerProgress:
    progress = LearnerProgress(
        stage=values["stage"],
        iteration=int(values["iteration"]),
        fraction=float(values["fraction"]),
        cost=float(values["cost"]),
        evaluations=int(values["evaluations"]),
        seconds_left=float(values["seconds_left"]),
    )
    if not 0.0 <= progress.fraction <= 1.0:
        raise ValueError("expected a fraction from 0 to 1")
    if not progress.stage.isprintable():
        raise ValueError("expected a stage that can be printed")
    return progress


class IterationClock:
    """Estimates how long the computing of an iteration still takes from how fast it advances."""

    def __init__(self) -> None:
        self._iteration = -1
        self._start = 0.0

    def seconds_left(self, iteration: int, fraction: float) -> float:
        """Return the time left [s], or NaN while nothing can be said."""
        now = time.monotonic()
        if iteration != self._iteration:
            self._iteration, self._start = iteration, now
        elapsed = now - self._start
        return elapsed * (1.0 - fraction) / fraction if fraction > 0.0 else math.nan
