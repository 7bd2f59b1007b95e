"""The simulated robots of the chapter."""

from __future__ import annotations

import dataclasses

import numpy as np

from sim_bridge.joints import ARM_JOINTS
from sim_bridge.simulation_settings import SimulationSettings

SLOWEST, FASTEST = 0.6, 1.2
"""Range of the unknown factors of a miscalibrated robot's joints."""

MISCALIBRATED_LAG = 0.1
"""Its delay of commands [s]."""


def default_robot(seed: int) -> SimulationSettings:
    """Return the robot as it comes: compliant servos, 50 ms late, sensor noise by the seed."""
    return SimulationSettings(seed=seed)


def miscalibrated_robot(seed: int) -> SimulationSettings:
    """Return a robot that makes 0.6 to 1.2 times the commanded speed, unknown for each joint."""
    return dataclasses.replace(
        default_robot(seed), command_lag=MISCALIBRATED_LAG, speed_factor=unknown_factors(seed)
    )


def delayed_robot(seed: int) -> SimulationSettings:
    """Return a robot whose arms are 0.4 s behind at constant speed, as was measured on a Baxter."""
    return dataclasses.replace(default_robot(seed), preset="delayed")


def delayed_miscalibrated_robot(seed: int) -> SimulationSettings:
    """Return a robot that is as late, and whose joints make 0.6 to 1.2 times the speed."""
    return dataclasses.replace(delayed_robot(seed), speed_factor=unknown_factors(seed))


def unknown_factors(seed: int) -> tuple[float, ...]:
    """Return the speed that each joint makes of a commanded 1 rad/s (14,), by the seed."""
    factors = np.random.default_rng(seed).uniform(SLOWEST, FASTEST, len(ARM_JOINTS))
    return tuple(float(factor) for factor in factors)


ROBOTS = {
    "default": default_robot,
    "miscalibrated": miscalibrated_robot,
    "delayed": delayed_robot,
    "delayed_miscalibrated": delayed_miscalibrated_robot,
}
