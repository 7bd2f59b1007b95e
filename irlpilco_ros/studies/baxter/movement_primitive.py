"""A dynamical movement primitive of each tool, its start and goal moved (Ijspeert et al. 2013).

The package movement_primitives fits Cartesian primitives to the tools' paths, as they were shown in
the robot's base frame, and rolls them out between start and goal where the pile is now. The joints
follow by the inverse kinematics that everything here is carried over by. That a goal is turned does
not turn the way there: the forcing term does not know of it.
"""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING, Any

import numpy as np

from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.kinematics.inverse import solve
from irlpilco_ros.kinematics.rigid_motion import pose_of_quaternion, quaternion_of
from irlpilco_ros.learning.numerics.arrays import Array

if TYPE_CHECKING:
    from irlpilco_ros.kinematics.carried_path import Carrier
    from irlpilco_ros.studies.baxter.places_bench import Spot

MISSING = (
    "The movement primitive was left out: the package movement_primitives was not installed where "
    "this was computed (pip install 'irlpilco_ros[study]')."
)

_WEIGHTS = 100
"""Per dimension: what was shown is met to 3 mm where nothing moved; more do not help."""

_EVERY = 5
"""Samples from one solution of the inverse kinematics to the next: 0.05 s."""


def installed() -> bool:
    """Whether the package is there."""
    return importlib.util.find_spec("movement_primitives") is not None


def joint_states(carrier: Carrier, shown: MotionPath, spot: Spot) -> Array:
    """Return positions and velocities at the ticks, shape (H + 1, 2J) [rad, rad/s].

    Args:
        carrier: With the robot's kinematics and limits.
        shown: The joints' path where it was shown.
        spot: Where the pile is; the joints stay near to what was carried over there.
    """
    wanted = tool_paths(carrier, shown, spot.move)
    carried = spot.shown.path.positions
    positions, times = [carried[0]], shown.times[::_EVERY]
    for sample, poses in zip(range(0, len(shown.times), _EVERY), wanted[::_EVERY], strict=True):
        arguments = (carried[sample], positions[-1], carrier.lower, carrier.upper)
        positions.append(solve(carrier.kinematics, poses, *arguments).positions)
    path = np.stack(positions[1:])
    speeds = np.gradient(path, times, axis=0)
    ticks = spot.task.dt * np.arange(spot.task.horizon + 1.0)
    states = np.hstack([path, speeds])
    return np.stack([np.interp(ticks, times, column) for column in states.T], axis=1)


def tool_paths(carrier: Carrier, shown: MotionPath, move: Array) -> Array:
    """Return poses of the tools, (n, K, 4, 4), start and goal moved rigidly; arguments as above."""
    poses = np.stack([carrier.kinematics.poses(positions) for positions in shown.positions])
    tools = [_rolled_out(shown.times, poses[:, tool], move) for tool in range(poses.shape[1])]
    return np.stack(tools, axis=1)


def _rolled_out(times: Array, poses: Array, move: Array) -> Array:
    from movement_primitives.dmp import CartesianDMP

    step = float(np.median(np.diff(times)))
    primitive: Any = CartesianDMP(float(times[-1]), step, _WEIGHTS)
    primitive.imitate(times, _as_vectors(poses))
    start, goal = _as_vectors(move @ poses[[0, -1]])
    primitive.configure(start_y=start, goal_y=goal)
    reached, vectors = primitive.open_loop()
    at = np.searchsorted(reached, times - 0.5 * step).clip(max=len(reached) - 1)
    return np.stack([pose_of_quaternion(one[:3], one[[4, 5, 6, 3]]) for one in vectors[at]])


def _as_vectors(poses: Array) -> Array:
    """Return positions and quaternions (w first), (n, 7), of poses (n, 4, 4); no sign jumps."""
    quaternions = np.stack([quaternion_of(pose) for pose in poses])
    turned = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    signs = np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))
    return np.hstack([poses[:, :3, 3], (signs[:, None] * quaternions)[:, [3, 0, 1, 2]]])
