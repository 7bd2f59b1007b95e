"""Linear prior means of the dynamics: f(x) = A x + g(x), with the GP learning g.

The mean is A m + E[g], the expected Jacobian A + V, and

    cov[f] = cov[g] + A S V' + V S A' + A S A'.

With cov[g] = V S V' + R that is (A + V) S (A + V)' + R: the remainder R is untouched.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array


def zero_prior(states: int, controls: int) -> Array:
    """Return the zero mean of the thesis (2.18), of shape (states, states + controls)."""
    return np.zeros((states, states + controls))


def velocity_prior(joints: int, dt: float) -> Array:
    """Return the mean of a velocity-controlled robot, for the state [positions, velocities].

    A joint integrates its command u [rad/s]: E[change of position] = dt u and
    E[change of velocity] = u - velocity.

    Args:
        joints: Number of joints J; the controls are their velocities, in the same order.
        dt: Control period [s].

    Returns:
        A of shape (2J, 3J), for the inputs [positions, velocities, controls].

    Raises:
        InvalidSettingError: if joints < 1 or dt is not positive.
    """
    if joints < 1 or not dt > 0.0:
        raise InvalidSettingError(
            f"velocity prior of {joints} joints with a control period of {dt} [s]; "
            "expected at least one joint and a positive period"
        )
    identity, nothing = np.eye(joints), np.zeros((joints, joints))
    return np.block([[nothing, nothing, dt * identity], [nothing, -identity, identity]])
