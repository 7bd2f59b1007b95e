"""Fifteen iterations of learning the cornered sweep with default settings on the simulated Baxter.

Only computing is timed, not the robot: the thesis needed about thirty hours for fifteen.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from benchmarks.timing import conditions
from irlpilco_ros.learning import LearningSettings, Rollout, Task, apprenticeship, judge
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import play_demonstration, run_episode
from sim_bridge.motion_files import CORNERED, load_motion
from sim_bridge.simulation_settings import SimulationSettings

ITERATIONS = 15
VELOCITY_LIMIT = np.tile([1.5, 1.5, 1.5, 1.5, 4.0, 4.0, 4.0], 2)  # [rad/s], both arms
BARS = {7: 20, 15: 60}
"""After how many iterations how much computing [s] is allowed on two cores."""


def main() -> None:
    """Print the computing time and the error of every iteration."""
    print(conditions())
    simulation = BaxterSimulation(SimulationSettings())
    task = Task((play_demonstration(simulation, load_motion(CORNERED)),), 0.5, VELOCITY_LIMIT)
    start = task.reference_states()[0, : task.control_size]
    settings = LearningSettings()

    def run(policy: Policy) -> Rollout:
        return run_episode(simulation, policy, start, task.horizon, task.dt)

    replay = judge(task, run(open_loop_policy(task))).rmse
    print(f"replay of the demonstration: RMSE {replay:.4f} rad")
    print("iteration   model s  policy s  total s  evaluations  RMSE [rad]")
    total = 0.0
    for done in islice(apprenticeship(task, settings, run), ITERATIONS + 1):
        total += done.model_seconds + done.policy_seconds
        bar = f"   (bar {BARS[done.index]} s)" if done.index in BARS else ""
        print(
            f"{done.index:9d}{done.model_seconds:10.2f}{done.policy_seconds:10.2f}{total:9.1f}"
            f"{done.evaluations:13d}{judge(task, done.trial).rmse:12.4f}{bar}",
            flush=True,
        )
