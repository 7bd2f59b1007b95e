"""One sweep at several places, each with the pile where it lay: an animation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irlpilco_ros.report.moving_pictures import animation
from irlpilco_ros.report.resimulation import film, workers
from sim_bridge.guided_motion import Guidable

MOST = 4
"""Number of places that are drawn."""


@dataclass(frozen=True)
class Swept:
    """A motion, and the pile that it was for.

    Attributes:
        motion: What the arms did.
        place: x, y [m] and turn [rad] of the pile, relative to where it was shown.
    """

    motion: Guidable
    place: tuple[float, float, float]

    @property
    def label(self) -> str:
        """Where it was, in words."""
        if not any(self.place):
            return "learned here"
        x, y, turn = self.place
        return f"at once: {x:+.2f}, {y:+.2f} m, {turn:+.2f} rad"


def moved_animation(swept: Sequence[Swept], seed: int) -> bytes:
    """Return the first `MOST` of some motions through debris scattered by a seed, as WebP.

    Raises:
        RenderingError: nothing here draws without a screen; says what to install.
    """
    with workers() as pool:
        jobs = [pool.submit(film, each.motion, seed, each.place) for each in swept[:MOST]]
        films = [job.result() for job in jobs]
    return animation(*((each.label, one) for each, one in zip(swept, films, strict=False)))
