"""What is expected of a robot whose joints move at the commanded velocity, before there are data.

`gp.prior_mean.velocity_prior` in the inputs that a robot's dynamics model sees, and the linear part
whose coefficients say by how much a real servo departs from that.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.state_layout import StateLayout


def velocity_mean(layout: StateLayout, controls: int, dt: float) -> Array:
    """Return A of the prior mean A x, shape (2J, P), for the model's inputs in this layout.

    Args:
        layout: Of a state [positions (J,), velocities (J,)].
        controls: Number of controls F; they are the velocities of the J joints, in their order.
        dt: Control period [s].

    Raises:
        InvalidSettingError: a joint is not commanded, or the model does not see its velocity.
    """
    joints = _joints(layout, controls)
    plain = velocity_prior(joints, dt)
    seen = len(layout.dynamics_inputs or ())
    mean = np.zeros((2 * joints, seen + controls))
    mean[:, _places(layout, range(joints, 2 * joints))] = plain[:, joints : 2 * joints]
    mean[:, seen:] = plain[:, 2 * joints :]
    return mean


def servo_part(layout: StateLayout, controls: int, dt: float) -> LinearPart:
    """Return the linear part by which each joint may depart from `velocity_mean`.

    Its coefficients are of the joint's own velocity, command and remembered commands; one of 1
    moves the joint as far as that velocity would in a period, or makes it that fast.

    Args:
        layout: Of a state [positions (J,), velocities (J,)].
        controls: Number of controls F.
        dt: Control period [s].

    Raises:
        InvalidSettingError: as `velocity_mean`.
    """
    joints = _joints(layout, controls)
    seen = len(layout.dynamics_inputs or ())
    own = [_places(layout, range(joints, 2 * joints)), list(range(seen, seen + joints))]
    for lag in range(layout.history):
        first = layout.measured_size + lag * controls
        own.append(_places(layout, range(first, first + joints)))
    columns = np.tile(np.array(own, dtype=np.intp).T, (2, 1))
    scales = np.repeat([dt, 1.0], joints)[:, None] * np.ones(columns.shape[1])
    return LinearPart(columns, scales)


def _joints(layout: StateLayout, controls: int) -> int:
    joints = layout.measured_size // 2
    if controls != joints or not layout.difference_mask.all():
        raise InvalidSettingError(
            f"prior_mean expects that each of the {joints} joints moves at its commanded velocity, "
            f"but {controls} are commanded; set prior_mean: zero"
        )
    return joints


def _places(layout: StateLayout, states: range) -> list[int]:
    """Return where the model's inputs have these states."""
    inputs = list(layout.dynamics_inputs or ())
    return [inputs.index(state) for state in states]
