"""A further part of a kernel of which only the size is sought."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class ScaledPart:
    """b^2 G beside the squared exponential, with log b ~ N(expected, 1) before any data.

    Attributes:
        gram: G, shape (n, n).
        expected: Mean of log b, where its search starts as well.
        bounds: Of log b in the search.
    """

    gram: Array
    expected: float
    bounds: tuple[float, float]

    def penalty(self, log_scale: float) -> tuple[float, float]:
        """Return -log p(log b) up to a constant, and its derivative."""
        off = log_scale - self.expected
        return 0.5 * off**2, off
