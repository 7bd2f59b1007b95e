"""The predicted trajectory of a policy in a dynamics model, and its gradient.

Forward: N(m, S) of the state -> policy -> joint Gaussian of the model's input -> increment ->
next state (thesis section 4, algorithm of Deisenroth & Rasmussen 2011). Each building block
returns its own pullback, so that the gradient is one reverse sweep over the same steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.gaussian import Array, Gaussian, Moments, Pullback, symmetric
from irlpilco_ros.learning.moment_matching import Method
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.state_layout import StateLayout
from irlpilco_ros.learning.trigonometric import sine_cosine_moments


class Dynamics(Protocol):
    """A dynamics model as far as prediction needs it."""

    def predict(
        self, mean: Array, covariance: Array, method: Method = ..., gradient: bool = ...
    ) -> tuple[Moments, Pullback | None]:
        """Return the moments of the prediction at a Gaussian input, and their pullback."""


StepPullback = Callable[[Array, Array], tuple[Array, Array, Array]]
"""(next mean_bar (D,), next covariance_bar (D, D)) ->
(mean_bar (D,), covariance_bar (D, D), parameters_bar (p,))."""


@dataclass(frozen=True)
class StepSensitivity:
    """How the predicted mean follows from the mean before and from the policy's parameters.

    Attributes:
        state: d m[t+1] / d m[t], shape (D, D).
        parameters: d m[t+1] / d theta at fixed m[t], shape (D, p).
    """

    state: Array
    parameters: Array


@dataclass(frozen=True)
class Step:
    """One step of a predicted trajectory.

    Attributes:
        state: The next state.
        pullback: From the next state's adjoints to this state's and the parameters'.
        sensitivity: The expected Jacobians, for Gauss-Newton.
    """

    state: Gaussian
    pullback: StepPullback
    sensitivity: Callable[[], StepSensitivity]


@dataclass(frozen=True)
class PredictedTrajectory:
    """What a policy is expected to do.

    Attributes:
        means: m[0..H], shape (H + 1, D).
        covariances: S[0..H], shape (H + 1, D, D).
        steps: The steps with their pullbacks; empty if no gradient was asked for.
    """

    means: Array
    covariances: Array
    steps: tuple[Step, ...]

    def gradient(self, means_bar: Array, covariances_bar: Array) -> Array:
        """Return the gradient of an objective by the policy's parameters, shape (p,).

        Args:
            means_bar: Derivative by `means`, shape (H + 1, D).
            covariances_bar: Derivative by `covariances`, symmetric, shape (H + 1, D, D).
        """
        mean_bar, covariance_bar = means_bar[-1], covariances_bar[-1]
        total: Array | None = None
        for t in range(len(self.steps) - 1, -1, -1):
            mean_bar, covariance_bar, own = self.steps[t].pullback(mean_bar, covariance_bar)
            total = own if total is None else total + own
            mean_bar = mean_bar + means_bar[t]
            covariance_bar = covariance_bar + covariances_bar[t]
        assert total is not None
        return total

    def mean_sensitivities(self) -> Array:
        """Return d m[t] / d theta along the expected Jacobians, shape (H + 1, D, p).

        The influence of the parameters on the means by way of the covariances is left out.
        """
        sensitivities = [np.zeros_like(self.steps[0].sensitivity().parameters)]
        for step in self.steps:
            local = step.sensitivity()
            sensitivities.append(local.state @ sensitivities[-1] + local.parameters)
        return np.stack(sensitivities)


def predict_trajectory(
    model: Dynamics,
    policy: Policy,
    start: Gaussian,
    horizon: int,
    layout: StateLayout,
    covariance: Method = "first_order",
    gradient: bool = True,
) -> PredictedTrajectory:
    """Return the states that a policy is expected to go through.

    Args:
        model: Predicts increments (or next values, see `layout.differences`).
        policy: What acts.
        start: The state at the start of a trial.
        horizon: Number of steps H.
        layout: What model and policy see of the state.
        covariance: "first_order" or "exact", between the outputs of the model.
        gradient: Whether the gradient will be asked for.

    Raises:
        NumericalError: if a predicted state is not finite.
    """
    means, covariances, steps = [start.mean], [start.covariance], []
    state = start
    for t in range(horizon):
        step = predict_step(model, policy, state, t, layout, covariance, gradient)
        state = step.state
        if not (np.isfinite(state.mean).all() and np.isfinite(state.covariance).all()):
            raise NumericalError(
                f"the predicted state at step {t + 1} of {horizon} is not finite; the dynamics "
                "model or the policy is beyond what can be represented"
            )
        means.append(state.mean)
        covariances.append(state.covariance)
        steps.append(step)
    return PredictedTrajectory(np.stack(means), np.stack(covariances), tuple(steps))


def predict_step(
    model: Dynamics,
    policy: Policy,
    state: Gaussian,
    t: int,
    layout: StateLayout,
    covariance: Method = "first_order",
    gradient: bool = True,
) -> Step:
    """Return the state after step t, given the state before it.

    The increment is correlated with the state through the model's input: with the expected
    Jacobian V and X = cov(x, input), cov(x, increment) = X V'.
    """
    extended, pull_extend = _extend(state, layout)
    dynamics_inputs = np.array(layout.dynamics_inputs, dtype=int)
    policy_inputs = np.array(layout.policy_inputs, dtype=int)
    size, mask = layout.state_size, layout.difference_mask

    view = Gaussian(
        extended.mean[policy_inputs], extended.covariance[np.ix_(policy_inputs, policy_inputs)]
    )
    control, pull_policy = policy.moments(view, t, gradient)
    to_policy = extended.covariance[:, policy_inputs]
    to_control = to_policy @ control.jacobian.T
    with_input = np.hstack([extended.covariance[:size, dynamics_inputs], to_control[:size]])
    own = np.hstack(
        [
            extended.covariance[np.ix_(dynamics_inputs, dynamics_inputs)],
            to_control[dynamics_inputs],
        ]
    )
    below = np.hstack([to_control[dynamics_inputs].T, control.covariance])
    model_mean = np.concatenate([extended.mean[dynamics_inputs], control.mean])
    increment, pull_model = model.predict(
        model_mean, np.vstack([own, below]), method=covariance, gradient=gradient
    )
    with_increment = mask[:, None] * (with_input @ increment.jacobian.T)
    after = Gaussian(
        mask * state.mean + increment.mean,
        symmetric(
            state.covariance * np.outer(mask, mask)
            + increment.covariance
            + with_increment
            + with_increment.T
        ),
    )
    known = len(dynamics_inputs)

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array, Array]:
        assert pull_model is not None
        assert pull_policy is not None
        with_increment_bar = 2.0 * mask[:, None] * covariance_bar
        with_input_bar = with_increment_bar @ increment.jacobian
        input_bar, input_covariance_bar = pull_model(
            mean_bar, covariance_bar, with_increment_bar.T @ with_input
        )
        to_control_bar = np.zeros_like(to_control)
        to_control_bar[dynamics_inputs] = 2.0 * input_covariance_bar[:known, known:]
        to_control_bar[:size] += with_input_bar[:, known:]
        view_bar, view_covariance_bar, parameters_bar = pull_policy(
            input_bar[known:],
            input_covariance_bar[known:, known:],
            to_control_bar.T @ to_policy,
        )
        extended_bar = np.zeros_like(extended.mean)
        extended_bar[dynamics_inputs] = input_bar[:known]
        extended_bar[policy_inputs] += view_bar
        spread_bar = np.zeros_like(extended.covariance)
        spread_bar[np.ix_(dynamics_inputs, dynamics_inputs)] = input_covariance_bar[:known, :known]
        spread_bar[np.ix_(policy_inputs, policy_inputs)] += view_covariance_bar
        spread_bar[:, policy_inputs] += to_control_bar @ control.jacobian
        spread_bar[:size, dynamics_inputs] += with_input_bar[:, :known]
        state_bar, state_covariance_bar = pull_extend(extended_bar, symmetric(spread_bar))
        return (
            state_bar + mask * mean_bar,
            state_covariance_bar + covariance_bar * np.outer(mask, mask),
            parameters_bar,
        )

    def sensitivity() -> StepSensitivity:
        assert pull_policy is not None
        extension = extended.jacobian
        by_state, by_control = increment.jacobian[:, :known], increment.jacobian[:, known:]
        through_policy = by_control @ control.jacobian @ extension[policy_inputs]
        zeros = np.zeros_like(control.covariance), np.zeros_like(control.jacobian)
        control_sensitivity = np.stack(
            [pull_policy(row, *zeros)[2] for row in np.eye(len(control.mean))]
        )
        return StepSensitivity(
            np.diag(mask) + by_state @ extension[dynamics_inputs] + through_policy,
            by_control @ control_sensitivity,
        )

    return Step(after, pullback, sensitivity)


def _extend(state: Gaussian, layout: StateLayout) -> tuple[Moments, ExtendPullback]:
    """Return the joint Gaussian of [x, sin and cos of the angles], and its pullback."""
    size = layout.state_size
    if not layout.angles:
        identity = Moments(state.mean, state.covariance, np.eye(size))
        return identity, lambda mean_bar, covariance_bar: (mean_bar, covariance_bar)
    trig, pull_trig = sine_cosine_moments(state, layout.angles)
    to_trig = state.covariance @ trig.jacobian.T
    extended = Moments(
        np.concatenate([state.mean, trig.mean]),
        np.block([[state.covariance, to_trig], [to_trig.T, trig.covariance]]),
        np.vstack([np.eye(size), trig.jacobian]),
    )

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array]:
        to_trig_bar = 2.0 * covariance_bar[:size, size:]
        trig_bar, trig_covariance_bar = pull_trig(
            mean_bar[size:], covariance_bar[size:, size:], to_trig_bar.T @ state.covariance
        )
        return (
            mean_bar[:size] + trig_bar,
            covariance_bar[:size, :size]
            + trig_covariance_bar
            + symmetric(to_trig_bar @ trig.jacobian),
        )

    return extended, pullback


ExtendPullback = Callable[[Array, Array], tuple[Array, Array]]
