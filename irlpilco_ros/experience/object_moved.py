"""Whether the object is still where a policy was made for, as far as who measures it can tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irlpilco_ros.experience.errors import ObjectMovedError
from irlpilco_ros.kinematics.rigid_motion import difference, mean_pose
from irlpilco_ros.learning.numerics.arrays import Array

STAYED, STAYED_TURN = 0.01, 0.05
"""What has moved less, in [m] and [rad], has stayed: five times what a good camera is off."""

_SURE = 4.0  # standard errors


def check_stayed(made_for: Sequence[Array], readings: Array) -> None:
    """Refuse to go on if the object is at none of the poses that a policy was made for.

    Args:
        made_for: Poses (4, 4), each from about as many readings as there are now.
        readings: Where it was last seen, (n, 4, 4), all of one place.

    Raises:
        ObjectMovedError: says how far it has moved.
    """
    now = mean_pose(readings)
    scatter = np.var(difference(now, readings), axis=0).reshape(2, 3).sum(axis=1)
    errors = _SURE * np.sqrt(2.0 * scatter / len(readings))
    way, turn = min(_distance(each, now) for each in made_for)
    if way > max(STAYED, errors[0]) or turn > max(STAYED_TURN, errors[1]):
        raise ObjectMovedError(
            f"the object has moved by {way:.3f} m and {turn:.3f} rad since the policy was made for "
            "where it was; call learner/adapt for one where it is now, or put it back"
        )


def _distance(before: Array, now: Array) -> tuple[float, float]:
    way, turn = np.linalg.norm(difference(now, before).reshape(2, 3), axis=1)
    return float(way), float(turn)
