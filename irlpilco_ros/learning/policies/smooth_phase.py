"""A linear policy with feed-forward that is continuous in time, and feedback blended in.

Held for a control period, a command makes an arm jump at every tick, and between the ticks the arm
is not where it was shown. Here the feed-forward goes on between the ticks; what feedback adds is
decided at the ticks and blended in so smoothly that the mean command of each period is the one that
was decided. A dynamics model that predicts from tick to tick needs to know no more than that.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.squashing import squash
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.base import REGISTRY
from irlpilco_ros.learning.policies.declaration import fixed, number
from irlpilco_ros.learning.policies.linear_phase import LinearPhasePolicy
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.learning.task import Task

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_TIMES, _SHARES = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS  # of a period, for its mean


@REGISTRY.register("smooth_phase")
@dataclass(frozen=True)
class SmoothPhasePolicy(LinearPhasePolicy):
    """u[t] = squash(W (x - x_E[t]) + B psi(t)), psi being each period's mean of bumps.

    Attributes:
        reference: x_E[t] of the demonstration, that gains act on no more than what is off it; the
            last one is kept after its end, shape (N, D).
        blend: Part r of each control period over which a decision is blended in, from 0 to 1.
    """

    @dataclass(frozen=True)
    class Settings:
        """How fine the feed-forward is, and how smoothly feedback comes in."""

        count: int = setting(
            33,
            "Number of bumps over the trial that the feed-forward is made of: more follow faster "
            "changes and take more parameters.",
            minimum=2,
            maximum=1000,
        )
        blend: float = setting(
            0.5,
            "Part of each control period over which a decision is blended in: 0 lets commands "
            "jump at every tick, 1 is smoothest and follows worst.",
            minimum=0.0,
            maximum=1.0,
        )

        def __post_init__(self) -> None:
            check(self)

    reference: Array = fixed(
        "N D", "What the policy would see at each tick if all went as shown, row by row."
    )
    blend: float = number(
        "Part of each control period over which a decision is blended in, from 0 to 1.", minimum=0.0
    )

    def __post_init__(self) -> None:
        """Check the fields."""
        super().__post_init__()
        if self.blend > 1.0:
            raise InvalidSettingError(
                f"blend of a smooth_phase policy is {self.blend}; expected at most 1"
            )

    @classmethod
    def zero(cls, task: Task, control_limit: Array, settings: Settings) -> Self:  # type: ignore[override]
        """Return the policy that does nothing."""
        F = task.control_size
        phases = np.zeros((F, settings.count))
        weights = np.zeros((F, task.policy_size))
        reference = np.zeros((1, task.policy_size))
        if task.demonstrations:
            reference = task.state_layout.policy_view(task.whole_reference_states()[:-1])
        return cls(weights, phases, task.horizon, control_limit, reference, settings.blend)

    def along(self, states: Array, controls: Array, control_limit: Array) -> Self:
        """Return the policy with the same gains on what is off other states."""
        there = dataclasses.replace(self, reference=states)
        return super(SmoothPhasePolicy, there).along(states, controls, control_limit)

    def between(self, time: float) -> Array:
        """Return the feed-forward (F,) at a time since the trial's start, in control periods."""
        bumps = bumps_at(np.array([time]), self.phase_weights.shape[1], self.horizon)
        return squash(self.phase_weights @ bumps[0], self.control_limit)

    def _seen(self, state: Array, step: int) -> Array:
        """Return how far a state (D,) is off what was shown."""
        off: Array = state - self.reference[min(step, len(self.reference) - 1)]
        return off

    def _phase(self, step: int) -> Array:
        """Return the mean of the bumps over a control period, shape (K,)."""
        mean: Array = self._means[min(step, self.horizon - 1)]
        return mean

    @cached_property
    def _means(self) -> Array:
        """The mean of the bumps over each control period, shape (H, K)."""
        times = (np.arange(self.horizon)[:, None] + _TIMES).ravel()
        bumps = bumps_at(times, self.phase_weights.shape[1], self.horizon)
        means: Array = np.einsum("s,tsk->tk", _SHARES, bumps.reshape(self.horizon, len(_TIMES), -1))
        return means


def bumps_at(times: Array, count: int, horizon: int) -> Array:
    """Return Gaussian bumps as wide as their spacing, summing to one, shape (n, count).

    Args:
        times: Since the trial's start, in control periods, shape (n,).
        count: Number of bumps, at least 2, spread evenly over the trial, ends included.
        horizon: Number of control periods of the trial; the end's value is kept after it.
    """
    places = np.clip(times, 0.0, horizon) * (count - 1) / horizon
    bumps = np.exp(-0.5 * (places[:, None] - np.arange(count)) ** 2)
    normalised: Array = bumps / bumps.sum(axis=1, keepdims=True)
    return normalised
