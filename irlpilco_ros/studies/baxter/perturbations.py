"""A feedback policy, not a recording: what happens when the robot is not as it was in learning.

Policies are learned on the default robot and then run once, without learning any more, on one that
was changed or is disturbed.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.studies.baxter import headline, reproduce
from irlpilco_ros.studies.baxter.baselines import baselines
from irlpilco_ros.studies.baxter.learning_run import (
    JOINTS,
    demonstration_of,
    joint_rmse,
    learned_policy,
    sweep_task,
)
from irlpilco_ros.studies.baxter.robots import default_robot, miscalibrated_robot
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.episode import move_to_start, run_trial
from sim_bridge.errors import ApproachError
from sim_bridge.pushed_baxter import PushedBaxter
from sim_bridge.simulation_settings import SimulationSettings
from sim_bridge.tool_kinematics import ToolKinematics

EXPERIMENT = "perturbations"

START_OFFSETS = {"start_0.05": 0.05, "start_0.1": 0.1}
"""Root-mean-square distance of the joints from the start [rad]."""

PUSH_STEP = 6
PUSH_FORCE = (0.0, -20.0, 0.0)  # [N]: sideways, away from the pan
PUSH_DURATION = 0.3  # [s]

_OTHER_NOISE = 1000  # added to the seed: noise that learning has not seen


def perturbed_robots(seed: int) -> dict[str, SimulationSettings]:
    """Return the robot of every perturbation by its name."""
    usual = dataclasses.replace(default_robot(seed), seed=_OTHER_NOISE + seed)
    lag = usual.effective_lag
    changes: dict[str, dict[str, Any]] = {
        "none": {},
        **{name: {} for name in START_OFFSETS},
        "lag_50ms": {"command_lag": lag + 0.05},
        "lag_100ms": {"command_lag": lag + 0.1},
        "speed_factors": {"speed_factor": miscalibrated_robot(seed).speed_factor},
        "payload_0.5kg": {"payload": 0.5},
        "doubled_noise": {
            "position_noise": 2.0 * usual.position_noise,
            "velocity_noise": 2.0 * usual.velocity_noise,
        },
        "push": {},
    }
    return {name: dataclasses.replace(usual, **change) for name, change in changes.items()}


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return the jobs of the baselines and of what was learned with default settings."""
    learned = [(seed, headline.headline_job(headline.DEFAULT, seed)) for seed in seeds]
    return [
        _job(name, seed, "defaults", need) for name in perturbed_robots(0) for seed, need in learned
    ]


def thesis_jobs(seeds: Sequence[int]) -> list[Job]:
    """Return the jobs of what was learned with the thesis's settings, which takes far longer."""
    learned = [(seed, reproduce.thesis_job("feature_matching", seed)) for seed in seeds]
    return [
        _job(name, seed, "thesis", need) for name in perturbed_robots(0) for seed, need in learned
    ]


def _job(name: str, seed: int, learner: str, need: Job) -> Job:
    arguments = {"perturbation": name, "seed": seed, "learner": learner}
    condition = name if learner == "defaults" else f"{name}_{learner}"
    return Job(EXPERIMENT, condition, seed, perturbation_run, arguments, (need,))


def perturbation_run(
    perturbation: str, seed: int, learner: str, needed: Sequence[Result]
) -> Result:
    """Run the policies on a perturbed robot; returns the joint error [rad] of each by name.

    Args:
        perturbation: A key of `perturbed_robots`.
        seed: Of the noise, and of the learned policy.
        learner: "defaults" (the baselines are run too) or "thesis": whose policy it is.
        needed: The learning run.
    """
    shown = demonstration_of(needed[0])
    task = sweep_task(shown)
    policies: dict[str, ActingPolicy] = baselines(task) if learner == "defaults" else {}
    policies[learner] = learned_policy(needed[0])
    start = shown.states[0, :JOINTS]
    if perturbation in START_OFFSETS:
        start = start + START_OFFSETS[perturbation] * start_direction(start, seed)
    errors = {}
    for name, policy in policies.items():
        robot = PushedBaxter(perturbed_robots(seed)[perturbation])
        tried = Pushing(policy, robot) if perturbation == "push" else policy
        # Hands that are heavier than the robot knows sag below the start, and begin from there.
        with contextlib.suppress(ApproachError):
            move_to_start(robot, start)
        errors[name] = joint_rmse(shown, run_trial(robot, tried, task.horizon, task.dt))
    return errors


def start_direction(start: Array, seed: int) -> Array:
    """Return a random direction (14,) of root-mean-square 1 that lifts both tools.

    Those that press the pan into the table are the same motion of the robot, none at all.
    """
    direction = np.random.default_rng(seed).standard_normal(JOINTS)
    _, jacobians = ToolKinematics()(start[None])
    half = JOINTS // 2
    for arm, height in ((slice(0, half), 2), (slice(half, JOINTS), 5)):
        if jacobians[0, height, arm] @ direction[arm] < 0.0:
            direction[arm] *= -1.0
    scaled: Array = direction / np.sqrt(np.mean(direction**2))
    return scaled


@dataclasses.dataclass(frozen=True)
class Pushing:
    """A policy during whose trial somebody pushes the brush's hand once.

    Attributes:
        policy: What decides.
        robot: What is pushed.
    """

    policy: ActingPolicy
    robot: PushedBaxter

    def act(self, state: Array, step: int) -> Array:
        """Return the policy's control (F,), and push at one of the ticks."""
        if step == PUSH_STEP:
            self.robot.push("right_hand", PUSH_FORCE, PUSH_DURATION)
        return self.policy.act(state, step)
