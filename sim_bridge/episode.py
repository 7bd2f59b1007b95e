"""Trials and demonstrations in one process: the controller's own motions on a simulated robot.

What runs here is what the controller's node runs, `MotionControl` with the same motions and the
same checks; only the wire between them is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.control.approach import Approach
from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motion_control import MotionControl, Outcome
from irlpilco_ros.control.motions import (
    ActingPolicy,
    Command,
    Guard,
    Motion,
    MotionStoppedError,
    Trial,
)
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.rollout import Rollout, mean_command
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.errors import ApproachError
from sim_bridge.guided_motion import Guidable, MinimumJerk
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.sensor_reading import SensorReading

Vector = NDArray[np.float64]

SETTINGS = ControllerSettings(position_margin=-1.0)
"""The controller's settings, but joints may lean on their stops, as a random policy makes them."""

_S0 = [ARM_JOINTS.index("left_s0"), ARM_JOINTS.index("right_s0")]
_S1 = [ARM_JOINTS.index("left_s1"), ARM_JOINTS.index("right_s1")]
_SPREAD = np.array([1.2, -1.2])  # [rad] of s0: both arms point outwards
_RAISED = -0.9  # [rad] of s1: hands well above the table


class Robot(Protocol):
    """What a motion needs of a simulated robot."""

    @property
    def robot_settings(self) -> RobotSettings:
        """What a controller must know of it."""

    def read(self) -> SensorReading:
        """Return the present joint states."""

    def command(self, names: Sequence[str], values: ArrayLike, /) -> None:
        """Command velocities [rad/s] or efforts [N, Nm]."""

    def step(self) -> None:
        """Advance by the period of the joint states."""


def run_episode(
    simulation: BaxterSimulation,
    policy: ActingPolicy,
    start: ArrayLike,
    horizon: int,
    dt: float = 0.5,
    each_state: Callable[[], None] | None = None,
) -> Rollout:
    """Move to the start and run one trial.

    Args:
        simulation: The robot, wherever it is.
        policy: Decides once per tick on [positions (14,), velocities (14,)] as measured.
        start: Positions (14,) of the arm joints to begin at [rad].
        horizon: Number of ticks H.
        dt: Control period [s].
        each_state: Called at every joint state of the trial, from its first to its last.

    Returns:
        States (H + 1, 28) as measured at the ticks, and controls (H, 14) [rad/s].

    Raises:
        ApproachError: the arms did not reach the start.
        MotionStoppedError: as `run_trial`.
    """
    move_to_start(simulation, start)
    return run_trial(simulation, policy, horizon, dt, each_state)


def run_trial(
    robot: Robot,
    policy: ActingPolicy,
    horizon: int,
    dt: float = 0.5,
    each_state: Callable[[], None] | None = None,
    guard: Guard | None = None,
) -> Rollout:
    """Run one trial from where the robot is; arguments and result as `run_episode`.

    A guard looks at the state at every tick.

    Raises:
        MotionStoppedError: a check stopped the robot, as it would on the real one.
    """
    states: list[Vector] = []
    sent: dict[int, list[Vector]] = {}

    def note(reading: SensorReading, command: Command) -> None:
        if command.stamp not in sent:
            states.append(reading.state(robot.robot_settings.joints))
        sent.setdefault(command.stamp, []).append(command.values)
        if each_state is not None:
            each_state()

    outcome = _carry_out(robot, Trial(policy, horizon, dt, guard), note)
    if not outcome.succeeded:
        raise MotionStoppedError(outcome.message)
    controls = [mean_command(np.array(each)) for each in sent.values()]
    return Rollout(states=np.array(states)[: horizon + 1], controls=np.array(controls)[:horizon])


def _carry_out(
    robot: Robot, motion: Motion, note: Callable[[SensorReading, Command], None] | None = None
) -> Outcome:
    """Have a controller carry out a motion; `note` gets every state and the answer to it."""
    control = MotionControl(robot.robot_settings, SETTINGS)
    outcomes: list[Outcome] = []
    commanded = robot.robot_settings.roles.commanded
    control.take(as_message(robot.read()), 0.0)
    control.start(motion, 0.0, outcomes.append)
    while True:
        reading = robot.read()
        command = control.take(as_message(reading), 0.0)
        assert command is not None  # every state is a new one
        if note is not None:
            note(reading, command)
        robot.command(commanded, command.values)
        if outcomes:
            return outcomes[0]
        robot.step()


def as_message(reading: SensorReading) -> JointStateMessage:
    """Return a reading as it goes over the wire."""
    return JointStateMessage(
        reading.stamp,
        reading.names,
        tuple(reading.positions.tolist()),
        tuple(reading.velocities.tolist()),
        tuple(reading.efforts.tolist()),
    )


def move_to_start(simulation: BaxterSimulation, start: ArrayLike) -> None:
    """Move the arms by velocity commands until they stand at `start`.

    They go straight in joint space; arms that have caught each other after a wild trial are first
    spread outwards, as a person would free them.

    Raises:
        ApproachError: something is still in the way.
    """
    goal = np.asarray(start, dtype=float)
    if _approach(simulation, goal).succeeded:
        return
    spread = _with_shoulders(simulation.true_positions, _SPREAD, _RAISED)
    above = _with_shoulders(goal, 0.7 * _SPREAD, goal[_S1] - 0.3)
    for waypoint in (spread, above):
        _approach(simulation, waypoint)
    outcome = _approach(simulation, goal)
    if not outcome.succeeded:
        raise ApproachError(outcome.message)


def _approach(simulation: BaxterSimulation, goal: Vector) -> Outcome:
    """Go straight to a goal."""
    robot = simulation.robot_settings
    return _carry_out(simulation, Approach(robot.joints, goal, robot.control_limit, SETTINGS))


def _with_shoulders(positions: Vector, s0: ArrayLike, s1: ArrayLike) -> Vector:
    """Return the positions with other shoulder angles, left and right."""
    changed = positions.copy()
    changed[_S0], changed[_S1] = s0, s1
    return changed


def play_demonstration(
    simulation: BaxterSimulation,
    motion: Guidable | None = None,
    dt: float = 0.5,
    each_state: Callable[[], None] | None = None,
) -> Rollout:
    """Guide the arms to the start of a motion and through it, as a person who teaches does.

    Args:
        simulation: The robot, wherever it is.
        motion: What to show; None is the sweep as a hand shows it.
        dt: Sampling period [s].
        each_state: Called at every joint state, from the start of the motion to its end.

    Returns:
        States (T + 1, 28) as measured every dt; the controls (T, 14) are NaN: nobody commanded.
    """
    shown = motion or load_motion()
    guide_to_start(simulation, shown)
    if each_state is not None:
        each_state()
    return guide_through(simulation, shown, dt, each_state)


def guide_to_start(simulation: BaxterSimulation, motion: Guidable) -> None:
    """Guide the arms smoothly to the first waypoint."""
    index = [simulation.joint_names.index(name) for name in motion.joints]
    start, _ = motion.at(0.0)
    approach = MinimumJerk.within_speed(
        simulation.true_positions[index], start, SETTINGS.approach_speed
    )
    begin = simulation.nanoseconds
    while (elapsed := (simulation.nanoseconds - begin) * 1e-9) < approach.duration:
        simulation.guide(motion.joints, *approach.at(elapsed))
        simulation.step()


def guide_through(
    simulation: BaxterSimulation,
    motion: Guidable,
    dt: float = 0.5,
    each_state: Callable[[], None] | None = None,
) -> Rollout:
    """Guide the arms through a motion from its start; arguments and result as above.

    Args:
        simulation: The robot, at the motion's first waypoint.
        motion: What to show.
        dt: Sampling period [s].
        each_state: Called after every 10 ms, for example to draw a picture.
    """
    names = simulation.joint_names
    begin = simulation.nanoseconds
    states = [simulation.read().state(names)]
    while (elapsed := simulation.nanoseconds - begin) < round(motion.duration * 1e9):
        simulation.guide(motion.joints, *motion.at(elapsed * 1e-9))
        simulation.step()
        if each_state is not None:
            each_state()
        if simulation.nanoseconds - begin >= round(len(states) * dt * 1e9):
            states.append(simulation.read().state(names))
    return Rollout(states=np.array(states), controls=np.full((len(states) - 1, len(names)), np.nan))
