"""The predicted trajectory of a policy in a dynamics model, and its gradient.

Forward: N(m, S) of the state -> policy -> joint Gaussian of the model's input -> increment ->
next state (thesis section 4; Deisenroth & Rasmussen 2011). Each building block returns its own
pullback, so that the gradient is one reverse sweep over the same steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, Pullback
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.known_part import KnownPart
from irlpilco_ros.learning.prediction.model_input import ModelInput, model_input
from irlpilco_ros.learning.state_layout import StateLayout


class Dynamics(Protocol):
    """A dynamics model as far as prediction needs it."""

    def predict(
        self,
        mean: Array,
        covariance: Array,
        approximation: CovarianceApproximation = ...,
        gradient: bool = ...,
        step: int | None = ...,
    ) -> tuple[Moments, Pullback | None]:
        """Return the moments at a Gaussian input in a step of a trial, and their pullback."""


StepPullback = Callable[[Array, Array], tuple[Array, Array, Array]]
"""(next mean_bar (D,), next covariance_bar (D, D)) ->
(mean_bar (D,), covariance_bar (D, D), parameters_bar (p,))."""


@dataclass(frozen=True)
class Step:
    """One step of a predicted trajectory.

    Attributes:
        state: The next state.
        input: State and control together, as the model saw them.
        jacobian: Expected Jacobian of the model's prediction by its input, shape (E, P).
        known: What is known of the next state beside that.
        pullback: From the next state's adjoints to this state's and the parameters'.
    """

    state: Gaussian
    input: ModelInput
    jacobian: Array
    known: KnownPart
    pullback: StepPullback

    @property
    def jacobians(self) -> tuple[Array, Array]:
        """Expected Jacobians of the next state: by this one (D, D), and by the control (D, F).

        The first goes through the policy as well.
        """
        return self.known.jacobians(self.input, self.jacobian)


@dataclass(frozen=True)
class PredictedTrajectory:
    """What a policy is expected to do.

    Attributes:
        means: m[0..H], shape (H + 1, D).
        covariances: S[0..H], shape (H + 1, D, D).
        steps: The steps with their pullbacks, which work if a gradient was asked for.
        policy: What acted.
    """

    means: Array
    covariances: Array
    steps: tuple[Step, ...]
    policy: Policy

    def gradient(self, means_bar: Array, covariances_bar: Array) -> tuple[Array, Array]:
        """Return the gradient of an objective by the policy's parameters, in a reverse sweep.

        Args:
            means_bar: Derivative by `means`, shape (H + 1, D).
            covariances_bar: Derivative by `covariances`, symmetric, shape (H + 1, D, D).

        Returns:
            The gradient (p,), and for each step the derivative by the covariance after it, what
            follows from it included, shape (H, D, D).
        """
        mean_bar, covariance_bar = means_bar[-1], covariances_bar[-1]
        gradients, after = [], []
        for t in range(len(self.steps) - 1, -1, -1):
            after.append(covariance_bar)
            mean_bar, covariance_bar, own = self.steps[t].pullback(mean_bar, covariance_bar)
            gradients.append(own)
            mean_bar = mean_bar + means_bar[t]
            covariance_bar = covariance_bar + covariances_bar[t]
        return np.sum(gradients, axis=0), np.stack(after[::-1])

    def mean_sensitivities(self) -> Array:
        """Return d m[t] / d theta along the expected Jacobians, shape (H + 1, D, p).

        With V = E df/d(x, u) and K = E du/dx:
        d m[t+1] / d theta = (A + V_x + (B + V_u) K) d m[t] / d theta + (B + V_u) d mu_u / d theta,
        A and B being what is known (`StateLayout.known_part`).
        The influence of the parameters on the means by way of the covariances is left out.
        """
        sensitivities: list[Array] = []
        for t, step in enumerate(self.steps):
            by_state, by_control = step.jacobians
            following = by_control @ self.policy.mean_sensitivity(step.input.view, t)
            if sensitivities:
                following += by_state @ sensitivities[-1]
            sensitivities.append(following)
        return np.stack([np.zeros_like(sensitivities[0]), *sensitivities])

    def spread_curvature(self, covariances_after_bar: Array) -> Array | None:
        """Return the curvature of the spread's cost by the policy's parameters, shape (p, p).

        A gain K changes the spread by (A + V_x + (B + V_u) K) S (...)', a quadratic whose
        curvature is weighed by what the spread costs from there on, as in LQR. None if the
        policy does not know it.

        Args:
            covariances_after_bar: Of each step, as `gradient` returns them, shape (H, D, D).
        """
        control_weights = []
        for step, cost_weight in zip(self.steps, covariances_after_bar, strict=True):
            _, by_control = step.jacobians
            values, vectors = np.linalg.eigh(by_control.T @ cost_weight @ by_control)
            control_weights.append((vectors * np.maximum(values, 0.0)) @ vectors.T)
        views = [step.input.view for step in self.steps]
        return self.policy.spread_curvature(views, range(len(views)), np.stack(control_weights))

    def change_metric(self, spread: float) -> Array | None:
        """Return G (p, p): d'G d is what a change d of the parameters does to all controls.

        The square of the change before squashing, expected over the predicted states, each spread
        by a standard deviation more, and summed over the steps. None if the policy does not know.

        Args:
            spread: Standard deviation added to every state.
        """
        views = [
            Gaussian(view.mean, view.covariance + spread**2 * np.eye(len(view.mean)))
            for view in (step.input.view for step in self.steps)
        ]
        return self.policy.change_metric(views, range(len(views)))


def predict_trajectory(
    model: Dynamics,
    policy: Policy,
    start: Gaussian,
    horizon: int,
    layout: StateLayout,
    approximation: CovarianceApproximation = "first_order",
    gradient: bool = True,
    noise: Array | None = None,
) -> PredictedTrajectory:
    """Return the states that a policy is expected to go through.

    Args:
        model: Predicts increments (or next values, see `layout.differences`).
        policy: What acts.
        start: The state at the start of a trial.
        horizon: Number of steps H.
        layout: What model and policy see of the state.
        approximation: "first_order" or "exact", between the outputs of the model.
        gradient: Whether the gradient will be asked for.
        noise: Variance of the sensors' noise in what the policy sees, shape (V,); None for none.

    Raises:
        NumericalError: if a predicted state is not finite.
    """
    state, steps = start, []
    known = KnownPart.of(layout, len(policy.control_limit))
    seen = np.zeros(len(layout.policy_inputs or ())) if noise is None else noise
    for t in range(horizon):
        step = predict_step(model, policy, state, t, layout, known, seen, approximation, gradient)
        state = step.state
        if not (np.isfinite(state.mean).all() and np.isfinite(state.covariance).all()):
            raise NumericalError(
                f"the predicted state at step {t + 1} of {horizon} is not finite; the dynamics "
                "model or the policy is beyond what can be represented"
            )
        steps.append(step)
    states = [start, *(step.state for step in steps)]
    return PredictedTrajectory(
        np.stack([state.mean for state in states]),
        np.stack([state.covariance for state in states]),
        tuple(steps),
        policy,
    )


def predict_step(
    model: Dynamics,
    policy: Policy,
    state: Gaussian,
    t: int,
    layout: StateLayout,
    known: KnownPart,
    noise: Array,
    approximation: CovarianceApproximation = "first_order",
    gradient: bool = True,
) -> Step:
    """Return the state after step t, given the state before it.

    The prediction f is correlated with w = [x, u] through the model's input: with V the expected
    Jacobian of f, cov(w, f) = cov(w, input) V', and in the terms of `KnownPart`
    S[t+1] = M cov(w) M' + N cov(f) N' + M cov(w, f) N' + N cov(f, w) M'.
    """
    seen, pull_input = model_input(policy, state, t, layout, noise, gradient)
    change, pull_model = model.predict(
        seen.mean, seen.covariance, approximation=approximation, gradient=gradient, step=t
    )

    def pullback(mean_bar: Array, covariance_bar: Array) -> tuple[Array, Array, Array]:
        assert pull_model is not None
        M, learned = known.matrix, known.learned
        with_change_bar = M.T @ (2.0 * covariance_bar[:, learned])
        input_bar, input_covariance_bar = pull_model(
            mean_bar[learned],
            covariance_bar[learned, learned],
            with_change_bar.T @ known.with_input(seen),
        )
        return known.pull(
            (M.T @ mean_bar, M.T @ covariance_bar @ M),
            (input_bar, input_covariance_bar, with_change_bar @ change.jacobian),
            pull_input,
        )

    return Step(known.following(state, seen, change), seen, change.jacobian, known, pullback)
