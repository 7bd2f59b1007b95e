"""A path of the joints, carried over to where its tools' object is now.

The tools go their ways as they were shown, moved rigidly with the object; the joints follow by
inverse kinematics, as near to the shown posture as that allows, and continuously.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.kinematics.inverse import REACHED, Solution, solve
from irlpilco_ros.kinematics.rigid_motion import part_of
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.threads import one_blas_thread

if TYPE_CHECKING:
    from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics

LIMIT_MARGIN = 0.07
"""How far from their limits joints stay, unless they were nearer when it was shown [rad]; more than
the controller asks for by default (`position_margin`), so that a trial is not stopped there. A
joint that goes less than 1 rad or 1 m in all has that much less of it."""

_APPROACH = 20  # parts in which the first posture goes to the new place
_COARSE = 0.5  # [s]: a place out of reach is found out on so few samples
_NEAR = 1e-4  # [m], [rad]: what is missing less is no question of reach


@dataclass(frozen=True)
class Carrier:
    """What carries paths over.

    Attributes:
        kinematics: Of the robot's J joints and its tools.
        lower: Lower limits of the joints (J,) [rad].
        upper: Upper limits (J,) [rad].
    """

    kinematics: RobotKinematics
    lower: Array
    upper: Array

    def carry(self, times: Array, positions: Array, move: Array) -> Array:
        """Return the positions (n, J) at which the tools are where they were, moved rigidly.

        Args:
            times: Of the positions, since the motion's start, shape (n,) [s].
            positions: As they were shown, shape (n, J) [rad].
            move: The rigid motion of the object since then, in the base frame, shape (4, 4).

        Raises:
            UnreachableError: says which tool comes how near to where it has to be, and when, or
                which joint would have to go how far beyond its limit.
        """
        with one_blas_thread():
            path = _Path(self, positions, move)
            few = np.searchsorted(times, np.arange(times[0], times[-1], _COARSE)).tolist()
            self._check(times, path, path.solutions([*few, len(times) - 1]))
            solutions = path.solutions(range(len(times)))
            self._check(times, path, solutions)
        return np.stack([solution.positions for solution in solutions.values()])

    def _check(self, times: Array, path: _Path, solutions: dict[int, Solution]) -> None:
        """Say what is wrong with the sample from whose poses the tools are farthest."""
        worst = max(solutions, key=lambda sample: np.abs(solutions[sample].missing).max())
        missing = np.abs(solutions[worst].missing).max()
        if missing <= REACHED:
            return
        solution, names = solutions[worst], self.kinematics.joints
        when = f"{times[worst]:.2f} s after the motion's start"
        unlimited = path.without_limits(worst)
        free = unlimited.positions
        beyond = np.maximum(self.lower - free, free - self.upper)
        joint = int(beyond.argmax())
        if np.abs(unlimited.missing).max() < _NEAR and beyond[joint] > -LIMIT_MARGIN:
            raise UnreachableError(
                f"{names[joint]} would have to go to {free[joint]:.3f} rad, "
                f"{when}; its limits are [{self.lower[joint]:g}, {self.upper[joint]:g}], and "
                f"{LIMIT_MARGIN:g} rad before them it stops"
            )
        ways, turns = np.linalg.norm(solution.missing.reshape(-1, 2, 3), axis=2).T
        tool = int((ways + turns).argmax())
        raise UnreachableError(
            f"{self.kinematics.tools[tool].name} is out of reach: {when} it comes no nearer than "
            f"{ways[tool]:.3f} m and {turns[tool]:.3f} rad to where it has to be"
        )


class _Path:
    """One path that is being carried over."""

    def __init__(self, carrier: Carrier, shown: Array, move: Array) -> None:
        self._kinematics, self._shown, self._move = carrier.kinematics, shown, move
        margin = LIMIT_MARGIN * np.minimum(1.0, carrier.upper - carrier.lower)
        self._lower = np.minimum(carrier.lower + margin, shown.min(axis=0))
        self._upper = np.maximum(carrier.upper - margin, shown.max(axis=0))

    def solutions(self, samples: Iterable[int]) -> dict[int, Solution]:
        """Return the solutions at these samples, each begun from what those before lead to."""
        found: dict[int, Solution] = {}
        away, change = self._first_step(), np.zeros(self._shown.shape[1])
        for sample in samples:
            solution = self._solve(sample, self._shown[sample] + away + change)
            now = solution.positions - self._shown[sample]
            change = now - away if found else change
            found[sample], away = solution, now
        return found

    def without_limits(self, sample: int) -> Solution:
        """Return what a sample's solution would be if joints had no limits."""
        none = np.full(len(self._lower), np.inf)
        poses = self._move @ self._kinematics.poses(self._shown[sample])
        start = self._shown[sample]
        return solve(self._kinematics, poses, start, start, -none, none)

    def _first_step(self) -> Array:
        """Return how far the first posture goes, brought to the new place little by little."""
        away, poses = np.zeros(self._shown.shape[1]), self._kinematics.poses(self._shown[0])
        for part in range(1, _APPROACH + 1):
            moved = part_of(self._move, part / _APPROACH) @ poses
            solution = self._at(moved, self._shown[0], self._shown[0] + away)
            away = solution.positions - self._shown[0]
            if not solution.reached:
                break  # as near as it comes
        return away

    def _solve(self, sample: int, start: Array) -> Solution:
        poses = self._move @ self._kinematics.poses(self._shown[sample])
        return self._at(poses, self._shown[sample], start)

    def _at(self, poses: Array, wanted: Array, start: Array) -> Solution:
        return solve(self._kinematics, poses, wanted, start, self._lower, self._upper)
