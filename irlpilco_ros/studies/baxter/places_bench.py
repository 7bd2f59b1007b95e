"""The bench at other places: the pile moved, and what was shown carried over with it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.carried_over import carried_over
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.experience.shown_motion import ShownMotion
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.kinematics.rigid_motion import inverse
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning import Rollout, Task
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter.debris import PIECES, pieces_in_pan
from irlpilco_ros.studies.baxter.learning_run import JOINTS
from irlpilco_ros.studies.baxter.motion_bench import PERIOD, MotionBench, robot_settings
from irlpilco_ros.studies.baxter.motion_measure import MotionMeasure, Recording
from irlpilco_ros.studies.baxter.robots import ROBOTS
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import move_to_start, run_trial
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.path_recorder import PathRecorder
from sim_bridge.pile import SHOWN, pile_pose

Place = tuple[float, float, float]
"""x, y [m] and turn [rad] of the pile, relative to where it lay when the sweep was shown."""

WIDEST, WIDEST_TURN = 0.08, 0.3
"""Places are drawn from within these, along x and y [m], and in angle [rad]."""

COUNT = 20
_DRAWN = 13  # the seed, of this very list


def drawn_places() -> tuple[Place, ...]:
    """Return the places of the study: drawn once, the same for every seed, in mm and mrad."""
    limit = np.array([WIDEST, WIDEST, WIDEST_TURN])
    drawn = np.random.default_rng(_DRAWN).uniform(-limit, limit, (COUNT, 3)).round(3)
    return tuple((float(x), float(y), float(turn)) for x, y, turn in drawn)


def places_from(number: int) -> tuple[Place, ...]:
    """Return all of these, beginning with the one of that number, modulo `COUNT`."""
    drawn, first = drawn_places(), number % COUNT
    return (*drawn[first:], *drawn[:first])


@dataclass(frozen=True, eq=False)
class Spot:
    """The sweep at a place and a speed.

    Attributes:
        place: Where the pile lies.
        move: The rigid motion of the pile from where it was shown, in the base frame (4, 4).
        task: To imitate what was shown, carried over.
        shown: That, as if it had been recorded there.
        measure: Measures trials there.
    """

    place: Place
    move: Array
    task: Task
    shown: Recording
    measure: MotionMeasure


class PlacesBench:
    """A robot that was shown the sweep at one place, and sweeps at others what lies there.

    Attributes:
        home: Where it was shown.
        carrier: Carries paths over to other places.
    """

    def __init__(self, robot: str, seed: int) -> None:
        """Show the sweep to a robot.

        Args:
            robot: A key of `ROBOTS`.
            seed: Of the robot, its noise and the scatter of the debris.
        """
        self.home = MotionBench(robot, seed, PERIOD)
        self._robot = robot_settings(PERIOD)
        tools = settings_from_parameters(
            ToolSettings, load_parameters_file(config_file("baxter.yaml"), "learner")
        )
        kinematics = kinematics_of(tools, ARM_JOINTS)
        self.carrier = Carrier(kinematics, self._robot.lower, self._robot.upper)
        settings = dataclasses.replace(ROBOTS[robot](seed), debris=PIECES, debris_seed=seed)
        self._simulation = BaxterSimulation(settings)

    def at(self, place: Place, speed: float = 1.0) -> Spot:
        """Return the sweep at another place, and so many times as fast as it was shown.

        Raises:
            UnreachableError: the robot cannot do it there, or so fast.
        """
        path, rollout = self.home.shown.path, self.home.task.demonstrations[0]
        nothing = np.full_like(path.positions, np.nan)
        samples = Trajectory(ARM_JOINTS, path.times, path.positions, path.velocities, nothing)
        move = pile_pose(place) @ inverse(SHOWN)
        moved = carried_over(
            ShownMotion(rollout, samples, None, 0.0), move, self.carrier, self._robot, speed
        )
        times = moved.samples.stamps - moved.samples.stamps[0] - moved.begin
        whole = MotionPath(times, moved.samples.positions, moved.samples.velocities)
        shown = Recording(moved.rollout, whole)
        task = dataclasses.replace(
            self.home.task,
            demonstrations=(moved.rollout,),
            horizon=moved.rollout.steps,
            speed=speed,
        )
        return Spot(place, move, task, shown, MotionMeasure(shown))

    def run(self, spot: Spot, policy: ActingPolicy) -> tuple[Rollout, dict[str, Any]]:
        """Move to the start, lay the pile, and sweep.

        Returns:
            What is learned from the trial, and how it went: `MotionMeasure.of`, and "pieces" of
            `PIECES` in the pan.

        Raises:
            ApproachError: the arms did not reach the start.
            MotionStoppedError: a check stopped the robot.
        """
        simulation, task = self._simulation, spot.task
        move_to_start(simulation, task.reference_states()[0, :JOINTS])
        simulation.lay_pile(spot.place)
        recorder = PathRecorder(simulation)
        rollout = run_trial(simulation, policy, task.horizon, task.dt, recorder.take)
        recording = Recording(rollout, recorder.path())
        measured = {**spot.measure.of(recording), "pieces": pieces_in_pan(simulation)}
        return self.home.rollout(recording, task.dt), measured

    def spots(self, places: Sequence[Place]) -> tuple[list[Spot], list[dict[str, Any]]]:
        """Return the sweep at each of these places, and those that are refused, with the reason."""
        found: list[Spot] = []
        refused: list[dict[str, Any]] = []
        for place in places:
            try:
                found.append(self.at(place))
            except UnreachableError as error:
                refused.append({"place": list(place), "reason": str(error)})
        return found, refused
