"""State and control together, as one Gaussian: the input of the dynamics model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.gaussian import Array, Gaussian, Moments, symmetric
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.state_layout import StateLayout
from irlpilco_ros.learning.trigonometric import sine_cosine_moments

InputPullback = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""(mean_bar (P,), covariance_bar (P, P), with_state_bar (D, P)) ->
(state mean_bar (D,), state covariance_bar (D, D), parameters_bar (p,))."""

ExtendPullback = Callable[[Array, Array], tuple[Array, Array]]
"""(mean_bar, covariance_bar) of the extended state -> those of the state."""


@dataclass(frozen=True)
class ModelInput:
    """What the dynamics model sees: some of the state (perhaps as sin and cos), and the control.

    Attributes:
        mean: Shape (P,).
        covariance: Shape (P, P).
        with_state: cov(x, input), shape (D, P).
        state_jacobian: E d input / d x, through the policy too, shape (P, D).
        control_sensitivity: Gives d (mean control) / d parameters, shape (F, p).
        change_metric: Gives the policy's `change_metric` (p, p), if it knows one, with the state
            spread by a standard deviation more.
        spread_curvature: From a price of control spread (F, F) to the curvature of its cost by
            the parameters (p, p); None if the policy does not know it.
    """

    mean: Array
    covariance: Array
    with_state: Array
    state_jacobian: Array
    control_sensitivity: Callable[[], Array]
    change_metric: Callable[[float], Array | None]
    spread_curvature: Callable[[Array], Array | None]


def model_input(
    policy: Policy, state: Gaussian, t: int, layout: StateLayout, gradient: bool = True
) -> tuple[ModelInput, InputPullback]:
    """Return the joint Gaussian of state and control at step t, and its pullback.

    With K the policy's expected Jacobian, cov(x, u) = cov(x, policy's view) K'.
    """
    extended, pull_extended = extended_state(state, layout)
    known, viewed = list(layout.dynamics_inputs or ()), list(layout.policy_inputs or ())
    known_block, viewed_block = np.ix_(known, known), np.ix_(viewed, viewed)
    size, split = layout.state_size, len(known)
    view = Gaussian(extended.mean[viewed], extended.covariance[viewed_block])
    control, pull_policy = policy.moments(view, t, gradient)
    with_view = extended.covariance[:, viewed]
    with_control = with_view @ control.jacobian.T
    cross = with_control[known]
    seen = ModelInput(
        np.concatenate([extended.mean[known], control.mean]),
        np.block([[extended.covariance[known_block], cross], [cross.T, control.covariance]]),
        np.hstack([extended.covariance[:size, known], with_control[:size]]),
        np.vstack([extended.jacobian[known], control.jacobian @ extended.jacobian[viewed]]),
        lambda: policy.mean_sensitivity(view, t),
        lambda spread: policy.change_metric(_spread_out(view, spread), t),
        lambda price: policy.spread_curvature(view, t, price),
    )

    def pullback(
        mean_bar: Array, covariance_bar: Array, with_state_bar: Array
    ) -> tuple[Array, Array, Array]:
        assert pull_policy is not None
        with_control_bar = np.zeros_like(with_control)
        with_control_bar[known] = 2.0 * covariance_bar[:split, split:]
        with_control_bar[:size] += with_state_bar[:, split:]
        view_bar, view_covariance_bar, parameters_bar = pull_policy(
            mean_bar[split:], covariance_bar[split:, split:], with_control_bar.T @ with_view
        )
        extended_bar = np.zeros_like(extended.mean)
        extended_bar[known] = mean_bar[:split]
        extended_bar[viewed] += view_bar
        spread_bar = np.zeros_like(extended.covariance)
        spread_bar[known_block] = covariance_bar[:split, :split]
        spread_bar[viewed_block] += view_covariance_bar
        spread_bar[:, viewed] += with_control_bar @ control.jacobian
        spread_bar[:size, known] += with_state_bar[:, :split]
        return *pull_extended(extended_bar, symmetric(spread_bar)), parameters_bar

    return seen, pullback


def _spread_out(state: Gaussian, deviation: float) -> Gaussian:
    wider = state.covariance + deviation**2 * np.eye(len(state.mean))
    return Gaussian(state.mean, wider)


def extended_state(state: Gaussian, layout: StateLayout) -> tuple[Moments, ExtendPullback]:
    """Return the joint Gaussian of [x, sin and cos of the angles], and its pullback."""
    size = layout.state_size
    if not layout.angles:
        identity = Moments(state.mean, state.covariance, np.eye(size))
        return identity, lambda mean_bar, covariance_bar: (mean_bar, covariance_bar)
    trig, pull_trig = sine_cosine_moments(state, layout.angles)
    with_trig = state.covariance @ trig.jacobian.T
    extended = Moments(
        np.concatenate([state.mean, trig.mean]),
        np.block([[state.covariance, with_trig], [with_trig.T, trig.covariance]]),
        np.vstack([np.eye(size), trig.jacobian]),
    )

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
        with_trig_bar = 2.0 * covariance_bar[:size, size:]
        trig_bar, trig_covariance_bar = pull_trig(
            mean_bar[size:], covariance_bar[size:, size:], with_trig_bar.T @ state.covariance
        )
        own = covariance_bar[:size, :size] + symmetric(with_trig_bar @ trig.jacobian)
        return mean_bar[:size] + trig_bar, own + trig_covariance_bar

    return extended, pullback
