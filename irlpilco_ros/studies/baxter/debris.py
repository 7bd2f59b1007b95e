"""The task itself: what lies in the pan after the sweep."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.studies.baxter import headline
from irlpilco_ros.studies.baxter.baselines import baselines
from irlpilco_ros.studies.baxter.learning_run import (
    JOINTS,
    demonstration_of,
    learned_policy,
    sweep_task,
)
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import play_demonstration, run_episode
from sim_bridge.motion_files import CORNERED, load_motion

EXPERIMENT = "debris"
PIECES = 20
_SETTLING_STEPS = 50  # of 10 ms


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return all jobs: for each seed another scatter of debris and another learned policy."""
    return [
        Job(
            EXPERIMENT,
            robot,
            seed,
            debris_run,
            {"robot": robot, "seed": seed},
            (headline.headline_job(robot, seed),),
        )
        for robot in (headline.DEFAULT, headline.MISCALIBRATED)
        for seed in seeds
    ]


def debris_run(robot: str, seed: int, needed: Sequence[Result]) -> Result:
    """Sweep; returns the number of pieces in the pan after each of four ways to do it.

    Args:
        robot: A key of `ROBOTS`.
        seed: Where the debris lies, and which learned policy.
        needed: The learning run.
    """
    settings = dataclasses.replace(ROBOTS[robot](seed), debris=PIECES, debris_seed=seed)
    shown = demonstration_of(needed[0])
    task = sweep_task(shown)
    policies: dict[str, ActingPolicy] = baselines(task)
    policies["learned"] = learned_policy(needed[0])
    counts = {}
    simulation = BaxterSimulation(settings)
    play_demonstration(simulation, load_motion(CORNERED))
    counts["demonstration"] = pieces_in_pan(simulation)
    for name, policy in policies.items():
        simulation = BaxterSimulation(settings)
        run_episode(simulation, policy, shown.states[0, :JOINTS], task.horizon, task.dt)
        counts[name] = pieces_in_pan(simulation)
    return counts


def pieces_in_pan(simulation: BaxterSimulation) -> int:
    """Let the arms stand for a moment, and count."""
    for _ in range(_SETTLING_STEPS):
        simulation.command(simulation.joint_names, np.zeros(JOINTS))
        simulation.step()
    return simulation.debris_in_pan()
