"""A simulated Baxter that can be pushed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sim_bridge.baxter_simulation import PERIOD, BaxterSimulation


class PushedBaxter(BaxterSimulation):
    """The robot, and somebody who bumps into it."""

    _push_end: int = 0

    def push(self, body: str, force: ArrayLike, duration: float) -> None:
        """Push a body from now on.

        Args:
            body: Name of a body of the model, such as "right_hand".
            force: (3,) in the base frame [N], at the body's centre of mass.
            duration: How long [s], rounded to 10 ms.
        """
        self.data.body(body).xfrc_applied[:3] = np.asarray(force, dtype=float)
        self._push_end = self.nanoseconds + round(duration * 1e9 / PERIOD) * PERIOD

    def step(self) -> None:
        """Advance by 10 ms; a push that is over is taken away first."""
        if self.nanoseconds >= self._push_end:
            self.data.xfrc_applied[:] = 0.0
        super().step()
