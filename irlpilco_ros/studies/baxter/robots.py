"""The simulated robots of the chapter."""

from __future__ import annotations

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
    factors = np.random.default_rng(seed).uniform(SLOWEST, FASTEST, len(ARM_JOINTS))
    return SimulationSettings(
        seed=seed,
        command_lag=MISCALIBRATED_LAG,
        speed_factor=tuple(float(factor) for factor in factors),
    )


ROBOTS = {"default": default_robot, "miscalibrated": miscalibrated_robot}
