"""What a motion takes of the room and the speed that each joint has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class JointUse:
    """One joint in one trial; NaN where nobody knows.

    Attributes:
        joint: Its name.
        reached: Least and largest position [rad].
        limits: Where it may go [rad].
        speed: Largest speed [rad/s].
        shown_speed: Largest speed in the demonstration [rad/s].
        speed_limit: How fast it may be [rad/s].
        command: Largest command, as it is decided [rad/s] or [Nm].
        command_limit: How large that may be.
    """

    joint: str
    reached: tuple[float, float]
    limits: tuple[float, float]
    speed: float
    shown_speed: float
    speed_limit: float
    command: float
    command_limit: float

    @property
    def room(self) -> float:
        """How far the joint stays from the nearer of its ends [rad]."""
        return min(self.reached[0] - self.limits[0], self.limits[1] - self.reached[1])

    @property
    def speed_share(self) -> float:
        """The largest speed as a share of what is allowed."""
        return self.speed / self.speed_limit


@dataclass(frozen=True)
class Movement:
    """A motion of J joints, as it was told.

    Attributes:
        positions: Shape (n, J) [rad].
        velocities: Shape (n, J) [rad/s].
    """

    positions: Array
    velocities: Array


def joint_uses(
    joints: Joints,
    configuration: Mapping[str, Any],
    trial: Movement,
    shown: Movement,
    controls: Array,
) -> tuple[JointUse, ...]:
    """Return what each joint used in a trial; nothing of a run that knows no limits.

    Args:
        joints: The joints (J), of which F are commanded.
        configuration: The run's; its limits count.
        trial: What was done.
        shown: What was to be done.
        controls: What was commanded at the decisions, shape (H, F).
    """
    lower, upper, speed_limit, effort_limit = (
        _numbers(configuration, key, len(joints.names))
        for key in ("position_lower", "position_upper", "velocity_limit", "effort_limit")
    )
    if not np.isfinite([lower, upper, speed_limit]).all():
        return ()
    is_effort = configuration.get("command_interface") == "effort"
    command_limit = effort_limit if is_effort else speed_limit
    commands = np.full(len(joints.names), math.nan)
    commands[joints.commanded_columns] = _largest(controls)
    speeds, shown_speeds = _largest(trial.velocities), _largest(shown.velocities)
    return tuple(
        JointUse(
            joint=name,
            reached=(float(trial.positions[:, j].min()), float(trial.positions[:, j].max())),
            limits=(float(lower[j]), float(upper[j])),
            speed=float(speeds[j]),
            shown_speed=float(shown_speeds[j]),
            speed_limit=float(speed_limit[j]),
            command=float(commands[j]),
            command_limit=float(command_limit[j]),
        )
        for j, name in enumerate(joints.names)
    )


def _largest(values: Array) -> Array:
    """Return the largest absolute value of each column; NaN of one that holds no number."""
    sizes = np.abs(values)
    found: Array = np.where(np.isfinite(sizes), sizes, -math.inf).max(axis=0, initial=-math.inf)
    return np.where(np.isfinite(found), found, math.nan)


def _numbers(configuration: Mapping[str, Any], key: str, count: int) -> Array:
    """Return the numbers of a setting; NaN if it is not there for every joint."""
    values = configuration.get(key)
    if not isinstance(values, list) or len(values) != count:
        return np.full(count, math.nan)
    if not all(isinstance(value, int | float) for value in values):
        return np.full(count, math.nan)
    return np.array(values, dtype=float)
