"""A robot on the bench: it is shown the sweep and tries it; all of each motion is measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.path_quality import MotionPath, path_quality
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.smoothing import smoothed_states
from irlpilco_ros.learning import LearningSettings, Rollout, Task
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter.learning_run import joint_rmse, try_policy
from irlpilco_ros.studies.baxter.robots import ROBOTS
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import play_demonstration
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import BY_HAND, load_motion
from sim_bridge.path_recorder import PathRecorder
from sim_bridge.tool_kinematics import TOOL_POINTS, ToolKinematics

EXPERIMENT = "motion"
ITERATIONS = 7
PERIOD = 0.25
"""Control period of config/sweep.yaml [s]."""

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


def sweep_settings() -> LearningSettings:
    """Return how the sweep is learned, by config/sweep.yaml."""
    return settings_from_parameters(LearningSettings, _parameters())


def _robot_settings(period: float) -> RobotSettings:
    """Return the robot and what of it is imitated, by the same file, with a control period [s]."""
    return settings_from_parameters(RobotSettings, {**_parameters(), "control_period": period})


def _parameters() -> dict[str, Any]:
    files = ("baxter.yaml", "sweep.yaml")
    each = [load_parameters_file(config_file(name), "learner") for name in files]
    return {name: value for values in each for name, value in values.items()}


class MotionBench:
    """A robot of `ROBOTS` that has been shown the sweep, as a hand does.

    Attributes:
        task: To imitate positions and velocities at the ticks.
        shown: The demonstration.
    """

    def __init__(self, robot: str, seed: int, period: float) -> None:
        """Show the sweep to a robot.

        Args:
            robot: A key of `ROBOTS`.
            seed: Of the robot and its noise.
            period: Control period [s].
        """
        settings = ROBOTS[robot](seed)
        self._simulation = BaxterSimulation(settings)
        self._kinematics = ToolKinematics()
        teacher = PathRecorder(self._simulation)
        shown = play_demonstration(
            self._simulation, load_motion(BY_HAND), period, each_state=teacher.take
        )
        self.shown = Recording(shown, teacher.path())
        robot_settings = _robot_settings(period)
        self.task = Task(
            (self.rollout(self.shown, period),),
            period,
            robot_settings.control_limit,
            robot_settings.feature_map,
            position_noise=settings.position_noise,
            velocity_noise=settings.velocity_noise,
        )

    @staticmethod
    def rollout(recording: Recording, period: float) -> Rollout:
        """Return what is learned from a motion: its ticks, by all that was told around them."""
        path = recording.path
        ticks = period * np.arange(len(recording.rollout.states), dtype=np.float64)
        states = smoothed_states(path.times, path.positions, path.velocities, ticks)
        return Rollout(states, recording.rollout.controls)

    def run(self, policy: ActingPolicy) -> Recording:
        """Move to the start and run one trial; errors as `try_policy`."""
        return Recording(*try_policy(self._simulation, policy, self.task))

    def measured(self, recording: Recording) -> dict[str, Any]:
        """Return how a motion went: at the ticks, over the whole path, how hard, and the tools.

        Returns:
            "ticks", "path" and "largest" errors of the joints [rad]; "acceleration_p99" and
            "acceleration_max" [rad/s^2]; "tools", the RMS distance of `TOOL_POINTS` over the path
            from where they were shown [m].
        """
        quality = path_quality(recording.path, [self.shown.path], BAXTER_JOINTS)
        return {
            "ticks": joint_rmse(self.shown.rollout, recording.rollout),
            "path": quality.rmse,
            "largest": quality.largest,
            "acceleration_p99": quality.acceleration_p99,
            "acceleration_max": quality.acceleration_max,
            "tools": self._tool_errors(recording.path),
        }

    def _tool_errors(self, path: MotionPath) -> list[float]:
        reached, _ = self._kinematics(path.positions)
        distances = (reached - self._wanted_tools).reshape(len(reached), len(TOOL_POINTS), 3)
        means: Array = np.sqrt((distances**2).sum(axis=2).mean(axis=0))
        return [float(mean) for mean in means]

    @cached_property
    def _wanted_tools(self) -> Array:
        wanted, _ = self._kinematics(self.shown.path.positions)
        return wanted
