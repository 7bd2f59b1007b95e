"""What a policy for another place is compared with: all carried over by the same kinematics.

"replay" sends the speeds that the joints would have been shown there; "tracking" is PD tracking of
that; "iterative" sends what iterative learning control has learned where it was shown, changed by
as much as the shown speeds are others here, alone or with PD. "primitive" is PD tracking of what a
dynamical movement primitive makes of the tools' paths when its start and goal move.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy, MotionStoppedError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.studies.baxter import movement_primitive
from irlpilco_ros.studies.baxter.baselines import PdTracking
from irlpilco_ros.studies.baxter.iterative_control import WAYS, improved, tracking
from irlpilco_ros.studies.baxter.motion_bench import ITERATIONS, MotionBench
from irlpilco_ros.studies.baxter.places_bench import Place, PlacesBench, Spot, places_from
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.errors import ApproachError

EXPERIMENT = "places"

AT = 5
"""Number of places at which a seed tries them: four seeds, at all of them."""

GAIN = 1.0
"""Of iterative learning control; of the five of `iterative_control` the best where it was shown."""


def baselines_job(
    robot: str, seed: int, iterations: int = ITERATIONS, places: Sequence[Place] | None = None
) -> Job:
    """Return the job of the baselines on a robot of `ROBOTS`; arguments as `baselines_run`.

    Without a list of places they are those of the study that learning practises with this seed.
    """
    arguments = {
        "robot": robot,
        "seed": seed,
        "iterations": iterations,
        "places": tuple(places_from(AT * seed)[:AT] if places is None else places),
    }
    return Job(EXPERIMENT, f"carried_{robot}", seed, baselines_run, arguments)


def baselines_run(robot: str, seed: int, iterations: int, places: Sequence[Place]) -> Result:
    """Return how each goes at every place, by name, as `PlacesBench.run`; None if it was stopped.

    Places where the sweep cannot be done are left out.

    Args:
        robot: A key of `ROBOTS`.
        seed: Of the robot.
        iterations: Trials of iterative learning control after its first, where it was shown.
        places: Where the pile lies.
    """
    bench = PlacesBench(robot, seed)
    speeds = {way: _iterative_speeds(bench.home, way, iterations) for way in WAYS}
    result: Result = {}
    for spot in bench.spots(places)[0]:
        for name, policy in _baselines(bench, spot, speeds).items():
            result.setdefault(name, []).append(_measured(bench, spot, policy))
    return result


def _baselines(bench: PlacesBench, spot: Spot, speeds: dict[str, Array]) -> dict[str, ActingPolicy]:
    task = spot.task
    shown = task.demonstrated_controls()
    faster = shown - bench.home.task.demonstrated_controls()
    policies: dict[str, ActingPolicy] = {
        "replay": open_loop_policy(task),
        "tracking": PdTracking(task.reference_states(), shown, task.control_limit),
    }
    for way, learned in speeds.items():
        policies[f"iterative_{way}"] = tracking(task, learned + faster, WAYS[way])
    if movement_primitive.installed():
        policies["primitive"] = _primitive(bench, spot)
    return policies


def _primitive(bench: PlacesBench, spot: Spot) -> PdTracking:
    task = spot.task
    states = movement_primitive.joint_states(bench.carrier, bench.home.shown.path, spot)
    joints = states.shape[1] // 2
    speeds = np.diff(states[:, :joints], axis=0) / task.dt
    return PdTracking(states, speeds, task.control_limit)


def _iterative_speeds(bench: MotionBench, way: str, iterations: int) -> Array:
    """Return what was learned by as many trials (H, J) [rad/s]."""
    speeds = bench.task.demonstrated_controls()
    for _ in range(iterations):
        trial = bench.run(tracking(bench.task, speeds, WAYS[way]))
        speeds = improved(bench, speeds, trial, GAIN)
    return speeds


def _measured(bench: PlacesBench, spot: Spot, policy: ActingPolicy) -> dict[str, Any] | None:
    try:
        return bench.run(spot, policy)[1]
    except (MotionStoppedError, ApproachError):
        return None
