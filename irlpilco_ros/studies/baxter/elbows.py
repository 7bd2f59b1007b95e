"""Shown three times with the same tools, but with the elbow of one arm in three places.

What a demonstrator does not care about differs from one demonstration to the next: the posture of
that arm. The mean of the three postures is none that holds the tools where they were: it leads the
brush past the pile. Which weights of tools and posture find out what matters?
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.path_quality import path_quality
from irlpilco_ros.kinematics.carried_path import LIMIT_MARGIN
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.inverse import solve
from irlpilco_ros.learning import LearningLoop, Rollout, Task
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.studies.baxter.debris import PIECES, pieces_in_pan
from irlpilco_ros.studies.baxter.learning_run import JOINTS
from irlpilco_ros.studies.baxter.motion_bench import (
    PERIOD,
    MotionBench,
    robot_settings,
    sweep_settings,
)
from irlpilco_ros.studies.baxter.motion_measure import BAXTER_JOINTS, MotionMeasure, Recording
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import move_to_start, play_demonstration, run_trial
from sim_bridge.guided_motion import Guidable, GuidedMotion
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import BY_HAND, load_motion
from sim_bridge.path_recorder import PathRecorder

EXPERIMENT = "elbows"
ROBOT = "default"
ITERATIONS = 5

PULLS = (0.0, -1.0, 1.0)
"""By how much the upper arm's roll of the arm with the brush is pulled in each demonstration [rad].
Where the brush stays where it is, the arm goes about half of that way."""

_PULLED = ARM_JOINTS.index("right_e0")
_INTERVAL = 0.02  # [s] between the postures that are computed
_RISE = 2.0  # [s] in which the elbow goes away from where it is in all demonstrations


@dataclass(frozen=True)
class Variant:
    """What is compared, and how its weights come about.

    Attributes:
        features: As in the robot's file.
        price: `posture_price` [m/rad].
        changes: Of the settings of config/sweep.yaml.
    """

    features: str
    price: float
    changes: dict[str, Any] = field(default_factory=dict)


VARIANTS = {
    "joints and speeds, max margin": Variant("motion", 1.0),
    "price 1, uniform": Variant("tools", 1.0, {"weight_rule": "uniform"}),
    "price 1, max margin": Variant("tools", 1.0, {"weight_rule": "max_margin"}),
    "price 1, max margin, floor 0.01": Variant(
        "tools", 1.0, {"weight_rule": "max_margin", "weight_floor": 0.01}
    ),
    "price 1, max margin beyond the spread": Variant(
        "tools", 1.0, {"weight_rule": "max_margin_spread"}
    ),
    "price 1, max margin beyond the spread, floor 0.01": Variant(
        "tools", 1.0, {"weight_rule": "max_margin_spread", "weight_floor": 0.01}
    ),
    "price 0.1 by hand, uniform": Variant("tools", 0.1, {"weight_rule": "uniform"}),
}
"""What stands in the table, by its name there."""

MEASURES: dict[str, tuple[Callable[[dict[str, Any]], float], float, str]] = {
    "brush tip [mm]": (lambda row: row["tools"][1], 1e3, ".1f"),
    "pan lip [mm]": (lambda row: row["tools"][0], 1e3, ".1f"),
    f"pieces of {PIECES}": (lambda row: row["pieces"], 1.0, ".3g"),
    "joints [mrad]": (lambda row: row["joints"], 1e3, ".1f"),
}
"""What is told of a trial there: the number in its row, and scale and form to print it."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs."""
    return [elbows_job(name, seed) for seed in seeds for name in VARIANTS]


def elbows_job(variant: str, seed: int, iterations: int = ITERATIONS) -> Job:
    """Return the job of a variant of `VARIANTS`; arguments as `elbows_run`."""
    condition = variant.replace(",", "").replace(" ", "_")
    arguments = {"variant": VARIANTS[variant], "seed": seed, "iterations": iterations}
    return Job(EXPERIMENT, condition, seed, elbows_run, arguments)


def elbows_run(variant: Variant, seed: int, iterations: int) -> Result:
    """Learn the sweep from demonstrations that differ in an elbow.

    Args:
        variant: What is compared, and how it is weighed.
        seed: Of the robot, its noise, the debris and learning.
        iterations: Learned policies, each tried once.

    Returns:
        "rows": of each trial what `ElbowBench.run` tells, and the "weights" it was learned with.
    """
    bench = ElbowBench(seed, variant)
    settings = dataclasses.replace(sweep_settings(), seed=seed, threads=1, **variant.changes)
    loop = LearningLoop(bench.task, settings)
    rows = []
    for _ in range(iterations + 1):
        iteration = loop.propose()
        trial, measured = bench.run(PolicyOf(BAXTER_JOINTS, iteration.policy))
        loop.take(trial)
        rows.append({**measured, "weights": np.asarray(iteration.weights).round(4).tolist()})
    return {"rows": rows}


class ElbowBench:
    """The default robot that was shown the sweep with three postures of one arm.

    Attributes:
        task: To imitate all three.
    """

    def __init__(self, seed: int, variant: Variant) -> None:
        """Show them; arguments as `elbows_run`."""
        robot = robot_settings(PERIOD)
        tools = dataclasses.replace(robot.tools, posture_price=variant.price)
        robot = dataclasses.replace(robot, features=variant.features, tools=tools)
        settings = dataclasses.replace(ROBOTS[ROBOT](seed), debris=PIECES, debris_seed=seed)
        self._simulation = BaxterSimulation(settings)
        self._shown = [self._show(elbow_motion(pull)) for pull in PULLS]
        self._measure = MotionMeasure(self._shown[0])
        self.task = Task(
            tuple(MotionBench.rollout(shown, PERIOD) for shown in self._shown),
            PERIOD,
            robot.control_limit,
            robot.feature_map,
            position_noise=settings.position_noise,
            velocity_noise=settings.velocity_noise,
        )

    def _show(self, motion: Guidable) -> Recording:
        teacher = PathRecorder(self._simulation)
        shown = play_demonstration(self._simulation, motion, PERIOD, each_state=teacher.take)
        return Recording(shown, teacher.path())

    def run(self, policy: ActingPolicy) -> tuple[Rollout, dict[str, Any]]:
        """Move to the start, lay the pile, and sweep; errors as `PlacesBench.run`.

        Returns:
            What is learned from the trial, and how it went: "joints", its distance from the mean of
            the demonstrations over the path [rad], "tools" as `MotionMeasure.of` tells it, and
            "pieces" of `PIECES` in the pan.
        """
        simulation, task = self._simulation, self.task
        move_to_start(simulation, task.reference_states()[0, :JOINTS])
        simulation.lay_pile((0.0, 0.0, 0.0))
        recorder = PathRecorder(simulation)
        rollout = run_trial(simulation, policy, task.horizon, PERIOD, recorder.take)
        recording = Recording(rollout, recorder.path())
        shown = [each.path for each in self._shown]
        measured = {
            "joints": path_quality(recording.path, shown, BAXTER_JOINTS).rmse,
            "tools": self._measure.of(recording)["tools"],
            "pieces": pieces_in_pan(simulation),
        }
        return MotionBench.rollout(recording, PERIOD), measured


def elbow_motion(pull: float) -> GuidedMotion:
    """Return the sweep by hand, with an elbow pulled aside and the tools where they are.

    It begins as it always does; within the first seconds the elbow goes where it stays. The
    redundancy of the arm is drawn to the posture with that joint so far off.

    Args:
        pull: How far that joint is pulled [rad].
    """
    robot, sweep = robot_settings(PERIOD), load_motion(BY_HAND)
    kinematics = kinematics_of(robot.tools, ARM_JOINTS)
    lower, upper = robot.lower + LIMIT_MARGIN, robot.upper - LIMIT_MARGIN
    times = np.arange(round(sweep.duration / _INTERVAL) + 1) * _INTERVAL
    found: list[Array] = []
    for time in times:
        positions, _ = sweep.at(time)
        wanted = positions.copy()
        wanted[_PULLED] += pull * np.sin(0.5 * np.pi * min(1.0, time / _RISE)) ** 2
        start = found[-1] if found else positions
        poses = kinematics.poses(positions)
        found.append(solve(kinematics, poses, wanted, start, lower, upper).positions)
    return GuidedMotion(sweep.joints, _INTERVAL, np.stack(found))
