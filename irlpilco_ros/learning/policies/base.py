"""What every policy can do, and the checks that all of them share."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.registry import Extension, Registry

Arrays = dict[str, Array | float | int]
"""A policy as named arrays and numbers: what files and ROS parameters hold."""


class Policy(Protocol):
    """A map from state and step to controls, for a robot and for a Gaussian belief alike."""

    @property
    def kind(self) -> str:
        """Name of the kind of policy, as in files."""

    @property
    def control_limit(self) -> Array:
        """Largest absolute value of each control, shape (F,)."""

    @property
    def state_size(self) -> int:
        """Number of state dimensions D that the policy sees."""

    @property
    def parameters(self) -> Array:
        """What policy search changes, as one vector (p,)."""

    def with_parameters(self, parameters: Array) -> Policy:
        """Return the same kind of policy with other parameters (p,)."""

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for a state (D,) at a step of the trial, within the limit."""

    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the control's moments at a Gaussian state, and their pullback if asked for."""

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d (mean control) / d parameters at a Gaussian state, shape (F, p).

        Used for Gauss-Newton curvature only: the influence of the parameters on the mean by way
        of the control's spread may be left out.
        """

    def spread_curvature(self, state: Gaussian, step: int, cost_weight: Array) -> Array | None:
        """Return the Hessian by the parameters (p, p) of tr(cost_weight cov u), as far as gains go.

        Args:
            state: The state that the policy sees.
            step: Step of the trial.
            cost_weight: What spread of the controls costs, positive semidefinite, shape (F, F).

        Returns:
            A positive semidefinite matrix, or None if this kind of policy does not know it.
        """

    def change_metric(self, state: Gaussian, step: int) -> Array | None:
        """Return G (p, p) with d'G d = E |change of the control before squashing|^2.

        The change is that of the parameters by d, the state Gaussian. None if this kind of policy
        does not know it; policy search then takes all parameters to matter alike.
        """

    def to_arrays(self) -> Arrays:
        """Return everything that `policies.from_arrays` needs to make this policy again."""


class RegisteredPolicy(Extension):
    """What the registry knows of a kind of policy.

    Attributes:
        is_searchable: Whether policy search can change it.
    """

    is_searchable: ClassVar[bool] = True


REGISTRY: Registry[Any] = Registry("irlpilco_ros.policies", RegisteredPolicy)
"""Every kind of policy by its name."""

register = REGISTRY.register


def searchable() -> tuple[str, ...]:
    """Return the names of the kinds of policy that policy search can change."""
    return tuple(cls.kind for cls in REGISTRY.classes() if cls.is_searchable)


def checked_array(owner: str, name: str, value: object, shape: tuple[int | None, ...]) -> Array:
    """Return the value as a finite float array of a shape; None stands for any length.

    Raises:
        InvalidSettingError: says which array of which policy is wrong, and what was expected.
    """
    array = np.array(value, dtype=float)
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = tuple("any" if want is None else want for want in shape)
        raise InvalidSettingError(
            f"{name} of a {owner} policy has shape {array.shape}; expected {wanted}"
        )
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidSettingError(
            f"{name} of a {owner} policy holds {array[where]} at {where}; expected finite numbers"
        )
    array.flags.writeable = False
    return array


def checked_limit(owner: str, value: object, size: int) -> Array:
    """Return the control limit as a finite, non-negative array (F,).

    Raises:
        InvalidSettingError: if it is not.
    """
    limit = checked_array(owner, "control_limit", value, (size,))
    if (limit < 0.0).any():
        raise InvalidSettingError(
            f"control_limit of a {owner} policy holds {limit.min()}; expected at least 0"
        )
    return limit


def checked_vector(policy: Policy, parameters: Array) -> Array:
    """Return the parameter vector if its length fits the policy.

    Raises:
        InvalidSettingError: if it does not.
    """
    vector = np.asarray(parameters, dtype=float)
    if vector.shape != policy.parameters.shape:
        raise InvalidSettingError(
            f"a {policy.kind} policy of this size has {policy.parameters.shape[0]} parameters; "
            f"got an array of shape {vector.shape}"
        )
    return vector
