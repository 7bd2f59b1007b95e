"""What happens at the same time of every trial, whatever the state is.

y = f(x) + b[t] + noise with b[t] ~ N(0, r^2) for each step t of a trial: what the state does not
show and yet repeats, such as the shape of a command within its period or a load that comes and
goes. Iterative learning control lives on nothing else (Bristow, Tharayil & Alleyne 2006); as a part
of the kernel, r^2 for points of the same step, the evidence says how much of it there is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.gp.scaled_part import ScaledPart
from irlpilco_ros.learning.numerics.arrays import Array

_EXPECTED = math.log(0.05)
"""log r before any data, relative to the targets' scale."""

_RANGE = math.log(1e3)


@dataclass(frozen=True)
class RepeatedPart:
    """To which step of its trial each training point belongs.

    Attributes:
        steps: Shape (n,), from 0.
        horizon: Number of steps H of a trial.
    """

    steps: NDArray[np.intp]
    horizon: int

    def of(self, rows: NDArray[np.intp]) -> Array:
        """Return which of the points (m,) belong to which step, ones and zeros, shape (m, H)."""
        belongs: Array = (self.steps[rows, None] == np.arange(self.horizon)).astype(np.float64)
        return belongs

    def scaled(self, rows: NDArray[np.intp], log_height: float) -> ScaledPart:
        """Return the part for some of the points, given the log of the targets' scale."""
        belongs = self.of(rows)
        expected = log_height + _EXPECTED
        return ScaledPart(belongs @ belongs.T, expected, (expected - _RANGE, expected + _RANGE))
