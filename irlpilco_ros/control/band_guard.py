"""A trial against what was predicted of it: reality that leaves the band stops the robot.

A hand in the way or a tool that was dropped shows long before a joint stalls. No ROS here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.motions import MotionStoppedError
from irlpilco_ros.experience.predicted_band import PredictedBand
from irlpilco_ros.learning.joints import Joints

Vector = NDArray[np.float64]

NEAR = 0.02
"""A joint this near to where it was expected is never taken for disturbed [rad]."""


@dataclass(frozen=True)
class BandGuard:
    """Compares a trial with its prediction, tick by tick.

    Attributes:
        joints: Joints of the robot (J).
        band: What was predicted.
        sigma: So many standard deviations a joint may be off.
    """

    joints: Joints
    band: PredictedBand
    sigma: float

    def check(self, tick: int, positions: Vector) -> None:
        """Compare positions (J,) [rad] at a tick.

        Raises:
            MotionStoppedError: names the joint that is farthest outside, and by how much.
        """
        expected, deviation = self.band.positions[tick], self.band.deviations[tick]
        off = positions - expected
        turning = [self.joints.names.index(name) for name in self.joints.continuous]
        off[turning] = np.arctan2(np.sin(off[turning]), np.cos(off[turning]))
        outside = np.abs(off) - np.maximum(self.sigma * deviation, NEAR)
        joint = int(outside.argmax())
        if outside[joint] > 0.0:
            raise MotionStoppedError(
                f"joint {self.joints.names[joint]} is {abs(off[joint]):.4f} rad from where it was "
                f"expected at tick {tick}, {expected[joint]:.4f} rad with a standard deviation of "
                f"{deviation[joint]:.4f} rad (guard_sigma {self.sigma:g}): is something in its "
                "way, or does it carry what it did not when it learned?"
            )
