"""What a simulated robot did between the decisions of a policy, as a recorder would keep it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.path_quality import MotionPath
from sim_bridge.episode import Robot


class PathRecorder:
    """Keeps the joint states of one motion."""

    def __init__(self, robot: Robot) -> None:
        """Keep nothing yet."""
        self._robot = robot
        self._stamps: list[int] = []
        self._states: list[NDArray[np.float64]] = []

    def take(self) -> None:
        """Keep the present joint states."""
        reading = self._robot.read()
        self._stamps.append(reading.stamp)
        self._states.append(reading.state(self._robot.robot_settings.joints))

    def path(self) -> MotionPath:
        """Return the motion, from the first state that was kept on."""
        times = (np.array(self._stamps) - self._stamps[0]) * 1e-9
        positions, velocities = np.hsplit(np.array(self._states), 2)
        return MotionPath(times, positions, velocities)
