"""A second robot by configuration alone: another arm, another task, the same everything else."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import islice

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning import LearningSettings, Rollout, Task, apprenticeship, judge
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter.robots import FASTEST, MISCALIBRATED_LAG, SLOWEST
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.arm_simulation import ArmSettings, ArmSimulation
from sim_bridge.episode import run_trial
from sim_bridge.motion_files import WIPE, load_motion

EXPERIMENT = "second_robot"
ITERATIONS = 5


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs: the arm as it should be, and miscalibrated as the Baxter of the headline."""
    return [
        Job(EXPERIMENT, robot, seed, wiping_run, {"robot": robot, "settings": settings})
        for seed in seeds
        for robot in ("default", "miscalibrated")
        for settings in (dataclasses.replace(LearningSettings(), seed=seed, threads=1),)
    ]


def arm_settings(robot: str, seed: int) -> ArmSettings:
    """Return the simulated arm: "default" or "miscalibrated"."""
    if robot == "default":
        return ArmSettings(seed=seed)
    factors = np.random.default_rng(seed).uniform(SLOWEST, FASTEST, 7)
    return ArmSettings(
        seed=seed,
        command_lag=MISCALIBRATED_LAG,
        speed_factor=tuple(float(factor) for factor in factors),
    )


def wiping_run(robot: str, settings: LearningSettings, iterations: int = ITERATIONS) -> Result:
    """Learn to wipe; returns the joint error [rad] of replay and of every trial."""
    values = load_parameters_file(config_file("panda.yaml"), "learner")
    configuration = settings_from_parameters(RobotSettings, values)
    arm = ArmSimulation(settings=arm_settings(robot, settings.seed))
    states = arm.show(load_motion(WIPE), configuration.control_period)
    shown = Rollout(states, np.full((len(states) - 1, len(configuration.joints)), np.nan))
    task = Task((shown,), configuration.control_period, configuration.control_limit)

    def trial(policy: ActingPolicy) -> Rollout:
        arm.place(shown.states[0, : len(configuration.joints)])
        return run_trial(arm, policy, task.horizon, task.dt)

    replay = judge(task, trial(open_loop_policy(task))).rmse
    learned = islice(apprenticeship(task, settings, trial), iterations + 1)
    return {
        "replay_rmse": replay,
        "rows": [{"rmse": judge(task, iteration.trial).rmse} for iteration in learned],
    }
