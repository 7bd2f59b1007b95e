"""Whether a policy can act at all: tried before it is given to a robot."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import Policy

_SPREAD = 1e-2  # of each state, about that of a measurement
_ROUNDING = 1e-9


def check_acts(policy: Policy, state: Array) -> None:
    """Try a policy at a state: control and moments are finite, the control within its limit.

    Finite arrays may still overflow in what is computed from them, as the exponentials of a radial
    basis function's logarithmic widths do.

    Args:
        policy: The policy.
        state: What it sees at the start of a trial, shape (D,).

    Raises:
        InvalidSettingError: says what the policy gives there instead.
    """
    owner = f"the {policy.kind} policy"
    near = Gaussian(state, _SPREAD**2 * np.eye(len(state)))
    try:
        with np.errstate(all="ignore"):
            control = np.asarray(policy.act(state, 0), dtype=float)
            moments, _ = policy.moments(near, 0, gradient=False)
    except Exception as error:  # whatever a policy of another package does
        raise InvalidSettingError(f"{owner} cannot act at its start: {error}") from error
    if control.shape != policy.control_limit.shape:
        raise InvalidSettingError(
            f"{owner} gives controls of shape {control.shape} at its start; expected "
            f"{policy.control_limit.shape}"
        )
    for name, values in (
        ("control", control),
        ("mean control", moments.mean),
        ("covariance of the control", moments.covariance),
        ("Jacobian of the control", moments.jacobian),
    ):
        if not np.isfinite(values).all():
            raise InvalidSettingError(
                f"the {name} of {owner} is not finite at its start: its numbers are too large "
                "or too small to compute with"
            )
    if (np.abs(control) > policy.control_limit * (1.0 + _ROUNDING)).any():
        raise InvalidSettingError(
            f"{owner} gives the control {control} at its start, beyond its own control_limit "
            f"{policy.control_limit}"
        )
