"""State and control together, as one Gaussian: the input of the dynamics model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.moments.trigonometric import sine_cosine_moments
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.state_layout import StateLayout

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
        view: What the policy sees, sensor noise included.
    """

    mean: Array
    covariance: Array
    with_state: Array
    state_jacobian: Array
    view: Gaussian


def model_input(
    policy: Policy,
    state: Gaussian,
    t: int,
    layout: StateLayout,
    noise: Array,
    gradient: bool = True,
) -> tuple[ModelInput, InputPullback]:
    """Return the joint Gaussian of state and control at step t, and its pullback.

    With K the policy's expected Jacobian, cov(x, u) = cov(x, policy's view) K'. The policy sees
    what sensors measure: the variance of their noise in each entry, shape (V,), adds to the view's.
    """
    extended, pull_extended = extended_state(state, layout)
    known, viewed = layout.dynamics_block[1][0], layout.policy_block[1][0]
    size = layout.state_size
    measured = extended.covariance[layout.policy_block] + np.diag(noise)
    view = Gaussian(extended.mean[viewed], measured)
    control, pull_policy = policy.moments(view, t, gradient)
    with_view = extended.covariance[:, viewed]
    with_control = with_view @ control.jacobian.T
    known_block = extended.covariance[layout.dynamics_block]
    seen = ModelInput(
        np.concatenate([extended.mean[known], control.mean]),
        joint_covariance(known_block, with_control[known], control.covariance),
        np.concatenate([extended.covariance[:size, known], with_control[:size]], axis=1),
        np.concatenate([extended.jacobian[known], control.jacobian @ extended.jacobian[viewed]]),
        view,
    )
    joint = _Joint(layout, with_view, with_control, control.jacobian, pull_policy, pull_extended)
    return seen, joint.pullback


@dataclass(frozen=True)
class _Joint:
    """What the pullback needs of state and control.

    Attributes:
        layout: What model and policy see.
        with_view: cov(extended state, policy's view).
        with_control: cov(extended state, control).
        control_jacobian: K.
        pull_policy: The policy's pullback; None without gradient.
        pull_extended: The extended state's pullback.
    """

    layout: StateLayout
    with_view: Array
    with_control: Array
    control_jacobian: Array
    pull_policy: ParameterPullback | None
    pull_extended: ExtendPullback

    def pullback(
        self, mean_bar: Array, covariance_bar: Array, with_state_bar: Array
    ) -> tuple[Array, Array, Array]:
        """Pull derivatives by the model's input back to the state and the parameters."""
        assert self.pull_policy is not None
        layout, size, whole = self.layout, self.layout.state_size, len(self.with_view)
        known, viewed = layout.dynamics_block[1][0], layout.policy_block[1][0]
        split = len(known)
        with_control_bar = np.zeros_like(self.with_control)
        with_control_bar[known] = 2.0 * covariance_bar[:split, split:]
        with_control_bar[:size] += with_state_bar[:, split:]
        view_bar, view_covariance_bar, parameters_bar = self.pull_policy(
            mean_bar[split:], covariance_bar[split:, split:], with_control_bar.T @ self.with_view
        )
        extended_bar = np.zeros(whole)
        extended_bar[known] = mean_bar[:split]
        extended_bar[viewed] += view_bar
        spread_bar = np.zeros((whole, whole))
        spread_bar[layout.dynamics_block] = covariance_bar[:split, :split]
        spread_bar[layout.policy_block] += view_covariance_bar
        spread_bar[:, viewed] += with_control_bar @ self.control_jacobian
        spread_bar[:size, known] += with_state_bar[:, :split]
        return *self.pull_extended(extended_bar, symmetric(spread_bar)), parameters_bar


def joint_covariance(first: Array, cross: Array, second: Array) -> Array:
    """Return [[A, B], [B', C]], the covariance of two Gaussians together."""
    size = len(first)
    joint = np.empty((size + len(second),) * 2)
    joint[:size, :size] = first
    joint[:size, size:] = cross
    joint[size:, :size] = cross.T
    joint[size:, size:] = second
    return joint


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
        joint_covariance(state.covariance, with_trig, trig.covariance),
        np.concatenate([np.eye(size), trig.jacobian]),
    )

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
        with_trig_bar = 2.0 * covariance_bar[:size, size:]
        trig_bar, trig_covariance_bar = pull_trig(
            mean_bar[size:], covariance_bar[size:, size:], with_trig_bar.T @ state.covariance
        )
        own = covariance_bar[:size, :size] + symmetric(with_trig_bar @ trig.jacobian)
        return mean_bar[:size] + trig_bar, own + trig_covariance_bar

    return extended, pullback
