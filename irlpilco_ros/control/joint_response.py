"""What each joint makes of its commands: a share of the speed, and a drift. No ROS here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.look import Look

Vector = NDArray[np.float64]

_GAIN_DEVIATION = 0.15  # of 1, before anything was seen
_GAIN_CHANGE = 0.01  # from look to look
_LOWEST_GAIN, _HIGHEST_GAIN = 0.3, 3.0
_CERTAIN = 3.0  # standard deviations
_UNSETTLED = 0.5  # [s]: how long a change of what holds the joints may have had no effect


class JointResponse:
    """Gain and drift of each joint, from what was commanded and what came of it.

    Attributes:
        gain: (J,) speed made of a commanded 1 rad/s.
        gain_deviation: (J,) its standard deviation.
        holding: (J,) commands that keep the joints where they are [rad/s]: the integral of the
            drifts that were seen for certain.
        held: (J,) by how much the last look changed that [rad/s].
    """

    def __init__(self, joints: int) -> None:
        """Take the joints for sound ones, until something else is seen."""
        self.gain = np.ones(joints)
        self.gain_deviation = np.full(joints, _GAIN_DEVIATION)
        self.holding = np.zeros(joints)
        self.held = np.zeros(joints)
        self._before: Look | None = None

    def learn(self, look: Look, way: Vector, remainder: float) -> Vector:
        """Learn from a look, and from the way (J,) [rad] that was commanded since the last one.

        What may be missing of that way at the look is `remainder` [rad].

        Returns:
            The drift under what held the joints up to now (J,) [rad/s], 0 where none is certain.
        """
        before, self._before = self._before, look
        drift, error = look.speed, look.speed_error
        if before is not None:
            time, moved = look.time - before.time, look.position - before.position
            noise = look.position_error + before.position_error + remainder
            noise = noise + _UNSETTLED * np.abs(self.held)
            self._learn_gain(way, moved - drift * time, np.hypot(noise, error * time))
            # What a short way leaves unexplained tells the drift better than any slope.
            # (Within what the slope allows: a joint that is blocked does not drift.)
            unexplained = (moved - self.gain * way) / time
            unexplained = unexplained.clip(drift - _CERTAIN * error, drift + _CERTAIN * error)
            deviation = np.hypot(noise, self.gain_deviation * np.abs(way)) / time
            weight = error**2 / (error**2 + deviation**2)
            drift = drift + weight * (unexplained - drift)
            error = np.sqrt(weight) * deviation
        # Who has drifted once drifts: then the smallest rest counts, as much as it is sure.
        certain = np.abs(drift) > _CERTAIN * error
        rest = np.where(self.holding != 0.0, drift * drift**2 / (drift**2 + error**2), 0.0)
        drift = np.where(certain, drift, rest)
        self.held = -drift / self.gain
        self.holding = self.holding + self.held
        return np.asarray(drift)

    def _learn_gain(self, way: Vector, made: Vector, error: Vector) -> None:
        variance = self.gain_deviation**2 + _GAIN_CHANGE**2
        weight = variance * way / (variance * way**2 + error**2)
        self.gain = (self.gain + weight * (made - self.gain * way)).clip(
            _LOWEST_GAIN, _HIGHEST_GAIN
        )
        self.gain_deviation = np.sqrt((1.0 - weight * way) * variance)
