"""What was shown, as it would have been shown where the object is now, and as fast as is wanted."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.experience.demonstration_checks import motion_faults
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.shown_motion import ROUNDING, ShownMotion, states_at
from irlpilco_ros.experience.smoothing import slopes
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.kinematics.rigid_motion import inverse
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.rollout import Rollout

_AROUND = 0.1
"""Of the recording before and after the motion that comes along, for states at its ends [s]."""


@dataclass(frozen=True)
class Moved:
    """Where an object is now.

    Attributes:
        object_pose: Its pose, in the base frame, (4, 4).
        demonstrated: Its pose in each of the demonstrations.
        carrier: With the robot's joints.
    """

    object_pose: Array
    demonstrated: Sequence[Array]
    carrier: Carrier

    @property
    def moves(self) -> list[Array]:
        """Its rigid motion since each demonstration, in the base frame, (4, 4)."""
        return [self.object_pose @ inverse(before) for before in self.demonstrated]


def carried_over(
    shown: ShownMotion, move: Array, carrier: Carrier, robot: RobotSettings, speed: float = 1.0
) -> ShownMotion:
    """Return a demonstration as the object, moved, would have seen it.

    Args:
        shown: What was shown.
        move: The rigid motion of the object since then, in the base frame, shape (4, 4).
        carrier: With the robot's joints.
        robot: Its limits.
        speed: As in `retimed`.

    Raises:
        UnreachableError: a tool cannot come there, or a joint would be beyond a limit or too fast.
    """
    samples, begin = _cut(shown, robot.control_period, speed)
    times = samples.stamps - samples.stamps[0]
    positions = carrier.carry(times - begin, samples.positions, move)
    velocities = samples.velocities + slopes(times, positions - samples.positions)
    moved = dataclasses.replace(samples, positions=positions, velocities=velocities)
    return _on_ticks(shown, moved, begin, robot, speed)


def retimed(shown: ShownMotion, robot: RobotSettings, speed: float) -> ShownMotion:
    """Return a demonstration, where it was shown, faster or slower: the same way in other times.

    It takes as many control periods as it needs. In what is left of the last one the robot does
    what was recorded next, or stands if nothing was.

    Args:
        shown: What was shown.
        robot: The robot's limits.
        speed: How many times as fast it is.

    Raises:
        UnreachableError: a joint would be too fast.
    """
    return _on_ticks(shown, *_cut(shown, robot.control_period, speed), robot, speed)


def _on_ticks(
    shown: ShownMotion, samples: Trajectory, begin: float, robot: RobotSettings, speed: float
) -> ShownMotion:
    """Return samples of a motion that begins at a time since the first of them [s], at a speed."""
    first = samples.stamps[0]
    fast = dataclasses.replace(
        samples,
        stamps=first + (samples.stamps - first) / speed,
        velocities=samples.velocities * speed,
    )
    begin /= speed
    _check(fast, begin, robot, speed)
    steps = _steps(shown, speed)
    ticks = begin + robot.control_period * np.arange(steps + 1.0)
    states = states_at(fast, ticks, robot.roles)
    controls = np.full((steps, shown.rollout.controls.shape[1]), np.nan)
    return ShownMotion(Rollout(states, controls), fast, shown.motion, begin, shown.notes)


def _steps(shown: ShownMotion, speed: float) -> int:
    return max(1, math.ceil(shown.rollout.steps / speed - ROUNDING))


def _cut(shown: ShownMotion, period: float, speed: float) -> tuple[Trajectory, float]:
    """Return the samples of the motion, and the time of x[0] since the first of them [s]."""
    samples = shown.samples
    times = samples.stamps - samples.stamps[0] - shown.begin
    end = period * max(shown.rollout.steps, _steps(shown, speed) * speed)
    part = np.flatnonzero((times >= -_AROUND) & (times <= end + _AROUND))
    cut = Trajectory(
        samples.joint_names,
        samples.stamps[part],
        samples.positions[part],
        samples.velocities[part],
        samples.commands[part],
    )
    return cut, float(-times[part[0]])


def _check(moved: Trajectory, begin: float, robot: RobotSettings, speed: float) -> None:
    wrong: Sequence[str] = motion_faults(moved, robot)
    if not wrong and robot.acceleration_limit:
        wrong = _too_hard(moved, begin, robot)
    if wrong:
        faster = [f"that is at speed {speed:g}; a lower one may do"] if speed > 1.0 else []
        raise UnreachableError("; ".join([*wrong, *faster]))


def _too_hard(moved: Trajectory, begin: float, robot: RobotSettings) -> list[str]:
    """Name the joint that is farthest beyond its acceleration limit; none is all right."""
    times = moved.stamps - moved.stamps[0]
    hardness = np.abs(slopes(times, moved.velocities)) / np.array(robot.acceleration_limit)
    sample, joint = np.unravel_index(int(hardness.argmax()), hardness.shape)
    if hardness[sample, joint] <= 1.0:
        return []
    limit = robot.acceleration_limit[joint]
    return [
        f"{robot.joints[joint]} would have to change its speed by "
        f"{hardness[sample, joint] * limit:.1f} rad/s^2, {times[sample] - begin:.2f} s after the "
        f"motion's start, where its acceleration_limit is {limit:g}"
    ]
