"""The bench at other places: the pile moved, and what was shown carried over with it."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.carried_over import carried_over
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.experience.shown_motion import ShownMotion
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.rigid_motion import inverse
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter.learning_run import baxter
from irlpilco_ros.studies.baxter.motion_bench import MotionBench, Recording
from irlpilco_ros.studies.baxter.robots import ROBOTS
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import run_episode
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.pile import SHOWN, pile_pose

WIDEST, WIDEST_TURN = 0.08, 0.3
"""Places are drawn from within these, along x and y [m], and in angle [rad]."""

PIECES = 20
_SETTLING_STEPS = 50  # of 10 ms


def places(seed: int, count: int) -> list[tuple[float, float, float]]:
    """Return places (x [m], y [m], turn [rad]) relative to where it was shown."""
    limit = np.array([WIDEST, WIDEST, WIDEST_TURN])
    drawn = np.random.default_rng([seed, 13]).uniform(-limit, limit, (count, 3))
    return [(float(x), float(y), float(turn)) for x, y, turn in drawn]


class MovedBench:
    """A bench, and benches that share its robot at other places."""

    def __init__(self, robot: str, seed: int, period: float) -> None:
        """Show the sweep to a robot; arguments as `MotionBench`."""
        self.here = MotionBench(robot, seed, period)
        self._robot = dataclasses.replace(baxter(), control_period=period)
        self._simulated = ROBOTS[robot](seed)
        values = load_parameters_file(config_file("baxter.yaml"), "learner")
        kinematics = kinematics_of(settings_from_parameters(ToolSettings, values), ARM_JOINTS)
        self._carrier = Carrier(kinematics, self._robot.lower, self._robot.upper)

    def at(self, place: Sequence[float]) -> MotionBench:
        """Return the bench at another place.

        Raises:
            UnreachableError: the robot cannot do it there.
        """
        path, rollout = self.here.shown.path, self.here.task.demonstrations[0]
        nothing = np.full_like(path.positions, np.nan)
        samples = Trajectory(ARM_JOINTS, path.times, path.positions, path.velocities, nothing)
        move = pile_pose(place) @ inverse(SHOWN)
        shown = ShownMotion(rollout, samples, None, 0.0)
        moved = carried_over(shown, move, self._carrier, self._robot)
        bench = copy.copy(self.here)
        vars(bench).pop("_wanted_tools", None)
        bench.task = dataclasses.replace(self.here.task, demonstrations=(moved.rollout,))
        times = moved.samples.stamps - moved.samples.stamps[0] - moved.begin
        whole = MotionPath(times, moved.samples.positions, moved.samples.velocities)
        bench.shown = Recording(moved.rollout, whole)
        return bench

    def pieces(self, place: Sequence[float], policy: ActingPolicy, start: Array) -> int:
        """Return how many of `PIECES` a policy sweeps into the pan, the pile being there.

        Raises:
            MotionStoppedError: a check stopped the robot.
        """
        settings = dataclasses.replace(
            self._simulated, debris=PIECES, debris_seed=self._simulated.seed
        )
        simulation = BaxterSimulation(
            dataclasses.replace(settings, object_place=tuple(map(float, place)))
        )
        task = self.here.task
        run_episode(simulation, policy, start, task.horizon, task.dt)
        for _ in range(_SETTLING_STEPS):
            simulation.command(simulation.joint_names, np.zeros(len(ARM_JOINTS)))
            simulation.step()
        return simulation.debris_in_pan()
