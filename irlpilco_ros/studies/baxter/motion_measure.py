"""What is measured of a motion beside the one that was shown: joints, how hard, and the tools."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.experience.path_quality import MotionPath, path_quality
from irlpilco_ros.learning import Rollout
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.studies.baxter.learning_run import joint_rmse
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.tool_kinematics import TOOL_POINTS, ToolKinematics

BAXTER_JOINTS = Joints(ARM_JOINTS)


@dataclass(frozen=True)
class Recording:
    """A motion: its ticks as they were measured, and every joint state from the first of them on.

    Attributes:
        rollout: States (H + 1, 2J) and the mean control of each period; NaN if nobody commanded.
        path: All states.
    """

    rollout: Rollout
    path: MotionPath


class MotionMeasure:
    """Measures motions against one that was shown."""

    def __init__(self, shown: Recording) -> None:
        """Take what is to be imitated."""
        self._shown = shown
        self._kinematics = ToolKinematics()
        self._tools, _ = self._kinematics(shown.path.positions)

    def of(self, recording: Recording) -> dict[str, Any]:
        """Return how a motion went: at the ticks, over the whole path, how hard, and the tools.

        Returns:
            "ticks", "path" and "largest" errors of the joints [rad]; "acceleration_p99" and
            "acceleration_max" [rad/s^2]; "tools", the RMS distance of `TOOL_POINTS` over the path
            from where they were shown [m].
        """
        quality = path_quality(recording.path, [self._shown.path], BAXTER_JOINTS)
        return {
            "ticks": joint_rmse(self._shown.rollout, recording.rollout),
            "path": quality.rmse,
            "largest": quality.largest,
            "acceleration_p99": quality.acceleration_p99,
            "acceleration_max": quality.acceleration_max,
            "tools": self._tool_errors(recording.path),
        }

    def _tool_errors(self, path: MotionPath) -> list[float]:
        reached, _ = self._kinematics(path.positions)
        times = self._shown.path.times
        shown = [np.interp(path.times, times, column) for column in self._tools.T]
        distances = (reached - np.stack(shown, axis=1)).reshape(-1, len(TOOL_POINTS), 3)
        means: Array = np.sqrt((distances**2).sum(axis=2).mean(axis=0))
        return [float(mean) for mean in means]
