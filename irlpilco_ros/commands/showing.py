"""Having a motion shown by the demonstrator, and recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from irlpilco_ros.ros.session import Session

APPROACH_TIMEOUT = 300.0
"""How long the demonstrator may take to its start [s]."""


def show(
    session: Session, recordings: Path, check: Callable[[], None] | None = None
) -> tuple[Path, str]:
    """Have the motion shown once.

    Args:
        session: A node to call the others with.
        recordings: Folder that gets the bag.
        check: Called now and then; what it raises ends the waiting.

    Returns:
        Path of the bag, and what the recorder says of it.

    Raises:
        ServiceError: says which step failed and why. Whatever was recorded is kept.
    """
    from irlpilco_ros.ros.trial_runner import TrialRunner

    session.trigger("demonstrator/move_to_start", APPROACH_TIMEOUT, check)
    trials = TrialRunner(session.clients)
    return session.run(trials.record("demonstrator/play", recordings), check)
