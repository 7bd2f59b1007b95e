"""From the tools' poses back to joint positions, near to where the joints are wanted.

Damped least squares on all tools at once; whatever freedom is left draws the joints towards the
wanted posture (Nakamura & Hanafusa 1986; Liegeois 1977):

    dq = J'(J J' + l^2)^-1 e + (1 - J^+ J)(q_wanted - q),

e being what is missing of the poses. A joint that would leave its limits stays at its limit, and
the others do the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from irlpilco_ros.kinematics.rigid_motion import difference
from irlpilco_ros.learning.numerics.arrays import Array

if TYPE_CHECKING:
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics

REACHED = 1e-9
"""Missing way [m] and angle [rad] of a pose that counts as reached."""

_STILL = 1e-6  # [rad]: the joints have come to rest
_STEPS = 40
_LAST_STEPS = 10  # for the tools alone: near a singular posture both wishes disturb each other
_LONGEST = 0.3  # [rad] of a step
_DAMPING = 1e-2  # relative to what is missing: none is left at the end
_FLAT = 1e-8  # of the largest singular value: below, no joint moves the tools that way


@dataclass(frozen=True)
class Solution:
    """Joint positions, and what they leave to be desired.

    Attributes:
        positions: Of the joints (J,) [rad].
        missing: Way [m] and rotation vector [rad] of each tool to its wanted pose, (K, 6).
        at_limit: Which joints were kept at a limit, (J,).
    """

    positions: Array
    missing: Array
    at_limit: Array

    @property
    def reached(self) -> bool:
        """Whether every tool is where it was wanted."""
        return bool(np.abs(self.missing).max() <= REACHED)


def solve(
    kinematics: RobotKinematics,
    poses: Array,
    wanted: Array,
    start: Array,
    lower: Array,
    upper: Array,
) -> Solution:
    """Return the joint positions next to the wanted ones at which the tools have these poses.

    Args:
        kinematics: Of J joints and K tools.
        poses: Of the tools, shape (K, 4, 4).
        wanted: Where the joints would be if it were for them, shape (J,) [rad].
        start: Where to begin, shape (J,) [rad].
        lower: Lower limits (J,) [rad].
        upper: Upper limits (J,) [rad].
    """
    free = np.ones(len(start), dtype=bool)
    positions = np.array(start)
    while True:
        positions, missing = _solve(kinematics, poses, wanted, positions, free)
        beyond = free & ((positions < lower - _STILL) | (positions > upper + _STILL))
        if not beyond.any():
            return Solution(positions, missing, ~free)
        free &= ~beyond
        positions = np.clip(positions, lower, upper)


def _solve(
    kinematics: RobotKinematics, poses: Array, wanted: Array, start: Array, free: Array
) -> tuple[Array, Array]:
    """Return positions and what is missing, moving the free joints alone."""
    positions, way = np.array(start), np.full(1, np.inf)
    for number in range(_STEPS):
        reached, jacobians = kinematics.poses_and_jacobians(positions)
        missing = difference(poses, reached)
        if np.abs(missing).max() <= REACHED and np.abs(way).max(initial=0.0) <= _STILL:
            break
        jacobian = jacobians.reshape(-1, len(positions))[:, free]
        wish = (wanted - positions)[free] * (number < _STEPS - _LAST_STEPS)
        step, way = _step(jacobian, missing.ravel(), wish)
        positions[free] += step
    return positions, missing


def _step(jacobian: Array, missing: Array, wish: Array) -> tuple[Array, Array]:
    """Return the step of the joints, and the part of it that the tools do not feel."""
    left, values, right = np.linalg.svd(jacobian, full_matrices=False)
    damping = (_DAMPING * np.linalg.norm(missing)) ** 2 + 1e-18
    along = right.T @ (values / (values**2 + damping) * (left.T @ missing))
    felt = right[values > _FLAT * values.max(initial=0.0)]
    unfelt = wish - felt.T @ (felt @ wish)
    step = along + unfelt
    return step * min(1.0, _LONGEST / max(np.abs(step).max(initial=0.0), 1e-12)), unfelt
