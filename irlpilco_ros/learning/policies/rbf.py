"""The radial-basis-function policy (thesis (4.7)), squashed, as in PILCO."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.moments.radial_basis import Bumps, FitPullback, bumps_moments, fit_bumps
from irlpilco_ros.learning.moments.squashing import squashed_moments
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import (
    Arrays,
    RegisteredPolicy,
    checked_array,
    checked_limit,
    checked_vector,
    register,
)
from irlpilco_ros.learning.settings import setting

RIDGE = 0.01**2
"""PILCO's: targets have a noise of 0.01 of the bumps' height."""

VARIANCE_FLOOR = 1e-6
"""PILCO's: added to each control's variance before squashing."""


@register("rbf")
@dataclass(frozen=True)
class RbfPolicy(RegisteredPolicy):
    """u_a = squash(sum_i beta_ai exp(-|x - c_i|^2 / 2)), |.| by widths, bumps through targets.

    The heights follow from targets at the centres, which is kinder to gradients than the heights
    themselves (Deisenroth & Rasmussen 2011).

    Attributes:
        centres: c, shape (N, D).
        targets: Wanted values at the centres before squashing, shape (N, F).
        log_widths: Shape (F, D), or (1, D) if all controls share their widths.
        control_limit: Largest absolute value of each control, shape (F,).
    """

    @dataclass(frozen=True)
    class Settings:
        """How many bumps there are."""

        count: int = setting(10, "Number of radial basis functions.", minimum=1, maximum=1000)

    centres: Array
    targets: Array
    log_widths: Array
    control_limit: Array

    def __post_init__(self) -> None:
        centres = checked_array(self.kind, "centres", self.centres, (None, None))
        targets = checked_array(self.kind, "targets", self.targets, (len(centres), None))
        widths = checked_array(self.kind, "log_widths", self.log_widths, (None, centres.shape[1]))
        limit = checked_limit(self.kind, self.control_limit, targets.shape[1])
        for name, value in (
            ("centres", centres),
            ("targets", targets),
            ("log_widths", widths),
            ("control_limit", limit),
        ):
            object.__setattr__(self, name, value)
        if len(widths) not in (1, len(limit)):
            raise InvalidSettingError(
                f"log_widths of an rbf policy has {len(widths)} rows; expected 1 (shared) or "
                f"{len(limit)}, one for each control"
            )

    @property
    def state_size(self) -> int:
        """Number of state dimensions D."""
        return int(self.centres.shape[1])

    @property
    def parameters(self) -> Array:
        """Centres, targets and log widths, each row by row."""
        return np.concatenate([self.centres.ravel(), self.targets.ravel(), self.log_widths.ravel()])

    def with_parameters(self, parameters: Array) -> RbfPolicy:
        """Return the policy with other parameters, laid out as in `parameters`."""
        vector = checked_vector(self, parameters)
        first, second = self.centres.size, self.centres.size + self.targets.size
        return RbfPolicy(
            vector[:first].reshape(self.centres.shape),
            vector[first:second].reshape(self.targets.shape),
            vector[second:].reshape(self.log_widths.shape),
            self.control_limit,
        )

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for a state (D,): the mean of `moments` without spread."""
        moments, _ = self.moments(Gaussian(state, np.zeros((len(state),) * 2)), step, False)
        return moments.mean

    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the exact moments of the control at a Gaussian state."""
        bumps, pull_fit = self._fit
        raw, pull_bumps = bumps_moments(bumps, state)
        floor = VARIANCE_FLOOR * np.eye(len(raw.mean))
        moments, pull_squash = squashed_moments(
            Moments(raw.mean, raw.covariance + floor, raw.jacobian), self.control_limit
        )

        def pullback(
            mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
        ) -> tuple[Array, Array, Array]:
            m_bar, S_bar, bar = pull_bumps(*pull_squash(mean_bar, covariance_bar, jacobian_bar))
            centres_bar, targets_bar, widths_bar = pull_fit(bar)
            if len(self.log_widths) == 1:
                widths_bar = widths_bar.sum(axis=0, keepdims=True)
            parts = (centres_bar, targets_bar, widths_bar)
            return m_bar, S_bar, np.concatenate([part.ravel() for part in parts])

        return moments, pullback if gradient else None

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d (mean control) / d parameters at a Gaussian state, shape (F, p)."""
        moments, pullback = self.moments(state, step)
        assert pullback is not None
        nothing = np.zeros_like(moments.covariance), np.zeros_like(moments.jacobian)
        return np.stack([pullback(row, *nothing)[2] for row in np.eye(len(moments.mean))])

    def spread_curvature(self, state: Gaussian, step: int, cost_weight: Array) -> Array | None:
        """Return None: the gains of a sum of bumps are no simple function of its parameters."""
        return None

    def change_metric(self, state: Gaussian, step: int) -> Array | None:
        """Return None: centres and widths change the control in no simple way."""
        return None

    def to_arrays(self) -> Arrays:
        """Return the fields by name."""
        return {
            "centres": self.centres,
            "targets": self.targets,
            "log_widths": self.log_widths,
            "control_limit": self.control_limit,
        }

    @cached_property
    def _fit(self) -> tuple[Bumps, FitPullback]:
        widths = np.broadcast_to(self.log_widths, (len(self.control_limit), self.state_size))
        return fit_bumps(self.centres, self.targets, widths, RIDGE)
