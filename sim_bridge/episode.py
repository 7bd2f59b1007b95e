"""Trials and demonstrations in one process, tick for tick as the nodes do them over ROS.

Tick k is the first joint state at or after k control periods. The policy decides on what that
state reports, noise included, and its command is repeated with every state until the next tick.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.learning.rollout import Rollout
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.errors import ApproachError
from sim_bridge.guided_motion import Approach, GuidedMotion, load_motion
from sim_bridge.joint_reading import JointReading
from sim_bridge.joints import ARM_JOINTS

Vector = NDArray[np.float64]

APPROACH_SPEED = 0.4  # [rad/s] of the fastest joint
APPROACH_TOLERANCE = 0.002  # [rad]
_APPROACH_GAIN = 3.0  # [1/s]
_PATIENCE = 5.0  # [s] more than twice the expected time until an approach has failed
_S0 = [ARM_JOINTS.index("left_s0"), ARM_JOINTS.index("right_s0")]
_S1 = [ARM_JOINTS.index("left_s1"), ARM_JOINTS.index("right_s1")]
_SPREAD = np.array([1.2, -1.2])  # [rad] of s0: both arms point outwards
_RAISED = -0.9  # [rad] of s1: hands well above the table
_SLOW = 0.03  # [rad/s]: above the noise of measured velocities


class Policy(Protocol):
    """What a trial needs of a policy (see irlpilco_ros.learning.policies)."""

    def act(self, state: Vector, step: int) -> Vector:
        """Return the control (F,) [rad/s] for the state (D,) at this tick."""


class Robot(Protocol):
    """What a trial needs of a simulated robot."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints of the state."""

    @property
    def commanded_names(self) -> tuple[str, ...]:
        """Those of them that are commanded."""

    def read(self) -> JointReading:
        """Return the present joint states."""

    def command(self, names: Sequence[str], values: ArrayLike, /) -> None:
        """Command velocities [rad/s] or efforts [N, Nm]."""

    def step(self) -> None:
        """Advance by the period of the joint states."""


def run_episode(
    simulation: BaxterSimulation, policy: Policy, start: ArrayLike, horizon: int, dt: float = 0.5
) -> Rollout:
    """Move to the start and run one trial.

    Args:
        simulation: The robot, wherever it is.
        policy: Decides once per tick on [positions (14,), velocities (14,)] as measured.
        start: Positions (14,) of the arm joints to begin at [rad].
        horizon: Number of ticks H.
        dt: Control period [s].

    Returns:
        States (H + 1, 28) as measured at the ticks, and controls (H, 14) [rad/s].

    Raises:
        ApproachError: the arms did not reach the start.
        InvalidCommandError: the policy's control is not finite or has a wrong length.
    """
    move_to_start(simulation, start)
    return run_trial(simulation, policy, horizon, dt)


def run_trial(simulation: Robot, policy: Policy, horizon: int, dt: float = 0.5) -> Rollout:
    """Run one trial from where the robot is; arguments and result as `run_episode`."""
    names, commanded = simulation.joint_names, simulation.commanded_names
    begin = simulation.read().stamp
    states, controls = [], []
    for tick in range(horizon):
        state = simulation.read().state(names)
        control = policy.act(state, tick)
        states.append(state)
        controls.append(control)
        tick_end = begin + round((tick + 1) * dt * 1e9)
        while simulation.read().stamp < tick_end:
            simulation.command(commanded, control)
            simulation.step()
    states.append(simulation.read().state(names))
    simulation.command(commanded, np.zeros(len(commanded)))
    return Rollout(states=np.array(states), controls=np.array(controls))


def move_to_start(simulation: BaxterSimulation, start: ArrayLike) -> None:
    """Move the arms by velocity commands until they stand at `start`.

    They go straight in joint space; arms that have caught each other after a wild trial are first
    spread outwards, as a person would free them.

    Raises:
        ApproachError: something is still in the way.
    """
    goal = np.asarray(start, dtype=float)
    if _approach(simulation, goal):
        return
    spread = _with_shoulders(simulation.true_positions, _SPREAD, _RAISED)
    above = _with_shoulders(goal, 0.7 * _SPREAD, goal[_S1] - 0.3)
    for waypoint in (spread, above):
        _approach(simulation, waypoint)
    if not _approach(simulation, goal):
        distance = goal - simulation.true_positions
        furthest = int(np.abs(distance).argmax())
        raise ApproachError(
            f"{simulation.joint_names[furthest]} is still {distance[furthest]:.4f} [rad] from the "
            f"start; expected {APPROACH_TOLERANCE} [rad]: is an arm blocked, or loaded beyond "
            "what its servo holds?"
        )


def _approach(simulation: BaxterSimulation, goal: Vector) -> bool:
    """Go straight to a goal; False if the arms are not there long after they should be."""
    names = simulation.joint_names
    joints = len(names)
    expected = np.abs(goal - simulation.true_positions).max() / APPROACH_SPEED
    for _ in range(round((2.0 * expected + _PATIENCE) * 100)):
        state = simulation.read().state(names)
        distance = goal - state[:joints]
        if np.abs(distance).max() < APPROACH_TOLERANCE and np.abs(state[joints:]).max() < _SLOW:
            simulation.command(names, np.zeros(joints))
            simulation.step()
            return True
        velocities = _APPROACH_GAIN * distance
        velocities *= min(1.0, APPROACH_SPEED / np.abs(velocities).max())
        simulation.command(names, velocities)
        simulation.step()
    return False


def _with_shoulders(positions: Vector, s0: ArrayLike, s1: ArrayLike) -> Vector:
    """Return the positions with other shoulder angles, left and right."""
    changed = positions.copy()
    changed[_S0], changed[_S1] = s0, s1
    return changed


def play_demonstration(
    simulation: BaxterSimulation, motion: GuidedMotion | None = None, dt: float = 0.5
) -> Rollout:
    """Guide the arms to the start of a motion and through it, as a person who teaches does.

    Args:
        simulation: The robot, wherever it is.
        motion: What to show; None is the sweep that comes with the package.
        dt: Sampling period [s].

    Returns:
        States (T + 1, 28) as measured every dt; the controls (T, 14) are NaN: nobody commanded.
    """
    shown = motion or load_motion()
    guide_to_start(simulation, shown)
    return guide_through(simulation, shown, dt)


def guide_to_start(simulation: BaxterSimulation, motion: GuidedMotion) -> None:
    """Guide the arms smoothly to the first waypoint."""
    index = [simulation.joint_names.index(name) for name in motion.joints]
    start, _ = motion.at(0.0)
    approach = Approach.within_speed(simulation.true_positions[index], start, APPROACH_SPEED)
    begin = simulation.nanoseconds
    while (elapsed := (simulation.nanoseconds - begin) * 1e-9) < approach.duration:
        simulation.guide(motion.joints, *approach.at(elapsed))
        simulation.step()


def guide_through(
    simulation: BaxterSimulation,
    motion: GuidedMotion,
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
