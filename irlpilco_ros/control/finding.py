"""What was found out about a robot: a sentence, and whether it is as it should be. No ROS here."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        is_right: Whether it is as it should be.
        text: What was looked at, what was seen, and if it is wrong, what was expected.
    """

    is_right: bool
    text: str

    def __str__(self) -> str:
        """Return the line that a person reads."""
        return f"{'ok   ' if self.is_right else 'WRONG'} {self.text}"
