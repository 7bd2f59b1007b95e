"""Commands for robots that take positions, as a JointTrajectoryController understands them."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from irlpilco_ros.control.motions import Vector

AHEAD = 0.1
"""For how long a command holds [s]: several joint states, so that the next one comes before."""

BRAKING = 0.1
"""In what time the robot comes to rest where no next one comes [s]."""


def short_trajectory(
    joints: Sequence[str], positions: Vector, velocities: Vector
) -> JointTrajectory:
    """Return what to follow from now on: on at these velocities, and then to rest.

    Without a stamp it begins when it arrives, and takes the place of the one before. It ends at
    rest because a JointTrajectoryController refuses what does not
    (`allow_nonzero_velocity_at_trajectory_end`), and so that a robot stops whose controller died.

    Args:
        joints: Those that are commanded (F).
        positions: Where they should be now (F,) [rad].
        velocities: How they should move (F,) [rad/s].
    """
    moved = positions + AHEAD * velocities
    rest = moved + 0.5 * BRAKING * velocities
    return JointTrajectory(
        joint_names=list(joints),
        points=[
            _point(moved, velocities, AHEAD),
            _point(rest, 0.0 * velocities, AHEAD + BRAKING),
        ],
    )


def _point(positions: Vector, velocities: Vector, seconds: float) -> JointTrajectoryPoint:
    return JointTrajectoryPoint(
        positions=positions.tolist(),
        velocities=velocities.tolist(),
        time_from_start=Duration(nanosec=round(1e9 * seconds)),
    )
