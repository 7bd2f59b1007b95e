"""A robot on the bench: it is shown the sweep and tries it; all of each motion is measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings, robot_from_parameters
from irlpilco_ros.experience.smoothing import smoothed_states
from irlpilco_ros.learning import LearningSettings, Rollout, Task
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter.learning_run import try_policy
from irlpilco_ros.studies.baxter.motion_measure import MotionMeasure, Recording
from irlpilco_ros.studies.baxter.robots import ROBOTS
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import play_demonstration
from sim_bridge.motion_files import BY_HAND, load_motion
from sim_bridge.path_recorder import PathRecorder

EXPERIMENT = "motion"
ITERATIONS = 7
PERIOD = 0.25
"""Control period of config/sweep.yaml [s]."""


def sweep_settings() -> LearningSettings:
    """Return how the sweep is learned, by config/sweep.yaml."""
    return settings_from_parameters(LearningSettings, _parameters())


def robot_settings(period: float) -> RobotSettings:
    """Return the robot and what of it is imitated, by the same file, with a control period [s]."""
    return robot_from_parameters({**_parameters(), "control_period": period})


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
        teacher = PathRecorder(self._simulation)
        shown = play_demonstration(
            self._simulation, load_motion(BY_HAND), period, each_state=teacher.take
        )
        self.shown = Recording(shown, teacher.path())
        self._measure = MotionMeasure(self.shown)
        robot_of_task = robot_settings(period)
        self.task = Task(
            (self.rollout(self.shown, period),),
            period,
            robot_of_task.control_limit,
            robot_of_task.feature_map,
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
        """Return how a motion went, as `MotionMeasure.of`."""
        return self._measure.of(recording)
