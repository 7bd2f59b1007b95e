"""What was shown, as it would have been shown where the object is now."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irlpilco_ros.experience.demonstration_checks import faults
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.shown_motion import ShownMotion, states_at
from irlpilco_ros.experience.smoothing import slopes
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.rollout import Rollout

_AROUND = 0.1
"""Of the recording before and after the motion that comes along, for states at its ends [s]."""


def carried_over(
    shown: ShownMotion, move: Array, carrier: Carrier, robot: RobotSettings
) -> ShownMotion:
    """Return a demonstration as the object, moved, would have seen it.

    Args:
        shown: What was shown.
        move: The rigid motion of the object since then, in the base frame, shape (4, 4).
        carrier: With the robot's joints.
        robot: Its limits.

    Raises:
        UnreachableError: a tool cannot come there, or a joint would be beyond a limit or too fast.
    """
    samples, begin = _cut(shown, robot.control_period)
    times = samples.stamps - samples.stamps[0]
    positions = carrier.carry(times - begin, samples.positions, move)
    velocities = samples.velocities + slopes(times, positions - samples.positions)
    moved = Trajectory(samples.joint_names, samples.stamps, positions, velocities, samples.commands)
    _check(moved, begin, robot)
    ticks = begin + robot.control_period * np.arange(shown.rollout.steps + 1.0)
    states = states_at(moved, ticks, robot.roles)
    controls = np.full_like(shown.rollout.controls, np.nan)
    return ShownMotion(Rollout(states, controls), moved, shown.motion, begin, shown.notes)


def _cut(shown: ShownMotion, period: float) -> tuple[Trajectory, float]:
    """Return the samples of the motion, and the time of x[0] since the first of them [s]."""
    samples = shown.samples
    times = samples.stamps - samples.stamps[0] - shown.begin
    end = period * shown.rollout.steps
    part = np.flatnonzero((times >= -_AROUND) & (times <= end + _AROUND))
    cut = Trajectory(
        samples.joint_names,
        samples.stamps[part],
        samples.positions[part],
        samples.velocities[part],
        samples.commands[part],
    )
    return cut, float(-times[part[0]])


def _check(moved: Trajectory, begin: float, robot: RobotSettings) -> None:
    wrong: Sequence[str] = faults(moved, robot)
    if not wrong and robot.acceleration_limit:
        wrong = _too_hard(moved, begin, robot)
    if wrong:
        raise UnreachableError("; ".join(wrong))


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
