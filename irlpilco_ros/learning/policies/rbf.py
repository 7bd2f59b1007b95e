"""The radial-basis-function policy (thesis (4.7)), squashed, as in PILCO."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.kernel import squared_exponential
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.moments.radial_basis import Bumps, FitPullback, bumps_moments, fit_bumps
from irlpilco_ros.learning.moments.squashing import squashed_moments
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import REGISTRY, SMALL, Policy
from irlpilco_ros.learning.policies.declaration import control_limit, parameter
from irlpilco_ros.learning.policies.ridge import BUMP_RIDGE, ridge
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.learning.task import Task

RIDGE = 0.01**2
"""PILCO's: targets have a noise of 0.01 of the bumps' height."""

VARIANCE_FLOOR = 1e-6
"""PILCO's: added to each control's variance before squashing."""


@REGISTRY.register("rbf")
@dataclass(frozen=True)
class RbfPolicy(Policy):
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

        count: int = setting(
            10,
            "Number of radial basis functions, each a bump around a state: more can do more "
            "complicated motions and take longer to learn.",
            minimum=1,
            maximum=1000,
        )

        def __post_init__(self) -> None:
            check(self)

    centres: Array = parameter(
        "N D", "State at which each radial basis function is centred, row by row."
    )
    targets: Array = parameter(
        "N F", "Value of each joint's control at each centre before squashing, row by row."
    )
    log_widths: Array = parameter(
        "W D",
        "Logarithm of the basis functions' width along each state dimension: one row for all "
        "controls, or one for each.",
    )
    control_limit: Array = control_limit()

    def __post_init__(self) -> None:
        """Check the fields; widths are shared, or there is one row for each control."""
        super().__post_init__()
        if len(self.log_widths) not in (1, len(self.control_limit)):
            raise InvalidSettingError(
                f"log_widths of an rbf policy has {len(self.log_widths)} rows; expected 1 (shared) "
                f"or {len(self.control_limit)}, one for each control"
            )

    @classmethod
    def zero(cls, task: Task, control_limit: Array, settings: Settings) -> Self:
        """Return flat bumps along the demonstration, as wide as it is long in each dimension."""
        states = task.state_layout.policy_view(task.whole_reference_states())
        widths = np.maximum(states.std(axis=0), 1e-2) * np.sqrt(states.shape[1])
        targets = np.zeros((settings.count, task.control_size))
        centres = states[_spread_steps(settings.count, task.horizon)]
        return cls(centres, targets, np.log(widths)[None], control_limit)

    @classmethod
    def random_start(
        cls, task: Task, start: Gaussian, settings: Settings, rng: np.random.Generator
    ) -> Self:
        """Return bumps that lie where they are told to, with small random heights.

        They are of width one, or as wide as they are scattered where that is more.
        """
        F, count = task.control_size, settings.count
        centres = rng.multivariate_normal(start.mean, start.covariance, count, method="eigh")
        targets = SMALL * rng.standard_normal((count, F))
        widths = np.sqrt(np.maximum(start.covariance.diagonal(), 1.0))
        return cls(centres, targets, np.tile(np.log(widths), (F, 1)), task.control_limit)

    def fit_demonstration(self, states: Array, controls: Array) -> Self:
        """Return the bumps that give the controls before squashing (H, F) at their centres."""
        nearest = _spread_steps(len(self.centres), len(states))
        return dataclasses.replace(self, targets=controls[nearest])

    def fit(self, steps: Array, states: Array, controls: Array) -> Self:
        """Return the same bumps, of heights that give controls before squashing (n, F), nearly."""
        widths = np.exp(self.log_widths)
        bumps = squared_exponential(states, self.centres, widths[0], 1.0)
        own = squared_exponential(self.centres, self.centres, widths[0], 1.0)
        heights = ridge(bumps, controls, BUMP_RIDGE)
        targets = (own + RIDGE * np.eye(len(own))) @ heights
        return dataclasses.replace(self, targets=targets)

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

    @cached_property
    def _fit(self) -> tuple[Bumps, FitPullback]:
        widths = np.broadcast_to(self.log_widths, (len(self.control_limit), self.state_size))
        return fit_bumps(self.centres, self.targets, widths, RIDGE)


def _spread_steps(count: int, horizon: int) -> Array:
    """Return as many steps as there are bumps, evenly over the trial."""
    steps: Array = np.round(np.linspace(0, horizon - 1, count)).astype(int)
    return steps
