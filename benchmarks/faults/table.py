"""What came of faults, as the table of docs/reliability.md."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

BAR = 0.15
"""Largest time from a fault to zero velocity [s]."""

_LONGEST = 220  # characters of what the user is told


@dataclass(frozen=True)
class Outcome:
    """What came of one try.

    Attributes:
        told: What the user is told.
        stopped_after: Time from the fault to zero velocity on the wire [s], steady clock; None if
            the robot is not to be stopped, infinite if it was not.
        lost: Samples that the recorder had said are on disk and that cannot be read; None if
            nothing was being recorded.
    """

    told: str
    stopped_after: float | None = None
    lost: int | None = None


@dataclass(frozen=True)
class Fault:
    """A row of the table: a fault, and what came of each try."""

    name: str
    outcomes: tuple[Outcome, ...]

    @property
    def held(self) -> bool:
        """Whether the robot was stopped in time, no sample was lost, and the user was told."""
        return all(
            outcome.told
            and (outcome.stopped_after is None or outcome.stopped_after <= BAR)
            and not outcome.lost
            for outcome in self.outcomes
        )


def markdown(faults: Sequence[Fault]) -> str:
    """Return the table."""
    head = [
        "| fault | tries | robot stopped after [s] | samples lost | what the user is told |",
        "|---|---|---|---|---|",
    ]
    return "\n".join([*head, *map(_row, faults)]) + "\n"


def _row(fault: Fault) -> str:
    cells = [
        fault.name,
        str(len(fault.outcomes)),
        _times([each.stopped_after for each in fault.outcomes]),
        _losses([each.lost for each in fault.outcomes]),
        _cell(fault.outcomes[-1].told),
    ]
    return f"| {' | '.join(cells)} |"


def _times(times: Sequence[float | None]) -> str:
    """Return the median and the longest of the times; a dash if the robot is not to be stopped."""
    known = [each for each in times if each is not None]
    if not known:
        return "-"
    if max(known) == float("inf"):
        return f"not stopped in {sum(each == float('inf') for each in known)}"
    longest = f"**{max(known):.3f}**" if max(known) > BAR else f"{max(known):.3f}"
    return f"{median(known):.3f}, at most {longest}"


def _losses(losses: Sequence[int | None]) -> str:
    known = [each for each in losses if each is not None]
    if not known:
        return "-"
    return f"**{sum(known)}**" if any(known) else "0"


def _cell(text: str) -> str:
    """Return a text that fits in a cell, without paths and run of the machine."""
    line = " ".join(text.split()).replace("|", "\\|")
    line = re.sub(r"(?<!\w)/[\w./-]*/", "", line)
    return line if len(line) <= _LONGEST else line[: _LONGEST - 1].rstrip() + "…"
