"""Linear prior means of the dynamics: f(x) = A x + g(x), with the GP learning g.

The mean is A m + E[g], the expected Jacobian A + V, and

    cov[f] = cov[g] + A S V' + V S A' + A S A'.

With cov[g] = V S V' + R that is (A + V) S (A + V)' + R: the remainder R is untouched.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.state_layout import StateLayout


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


def seen_prior(prior: Array, layout: StateLayout) -> Array:
    """Return a prior mean of the state and the controls, for what a dynamics model sees of them.

    Sine and cosine of an angle say nothing linear about a change: their columns are zero, and that
    of an angle that is not seen itself is left out.

    Args:
        prior: A for the inputs [state, controls] and increments of all states, shape (D, D + F).
        layout: What the model sees, P of the D states and their sines and cosines, and what it
            predicts.

    Returns:
        A of shape (D, P + F).
    """
    size = layout.state_size
    of_state = prior[:, :size] + np.diag(1.0 - layout.difference_mask)
    extended = np.hstack([of_state, np.zeros((size, 2 * len(layout.angles or ())))])
    return np.hstack([extended[:, list(layout.dynamics_inputs or ())], prior[:, size:]])
