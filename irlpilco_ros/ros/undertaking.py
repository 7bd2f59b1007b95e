"""What a service is doing for somebody, which somebody else may cancel."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.ros.learner_worker import CancelledError


@dataclass
class Undertaking:
    """One iteration, from the call to the answer.

    Attributes:
        cancelled: Whether it is to end as soon as it can.
        done: Whether it came to its end all the same.
    """

    cancelled: bool = False
    done: bool = False

    def check(self) -> None:
        """Break off; called between two steps, and by what takes long.

        Raises:
            CancelledError: it is cancelled.
        """
        if self.cancelled:
            raise CancelledError("broken off by learner/cancel")
