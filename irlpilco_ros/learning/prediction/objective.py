"""The objective of policy search: cost of the predicted trajectory, as a function of theta."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irlpilco_ros.learning.costs import Cost, CostValue
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.predicted_trajectory import (
    Dynamics,
    PredictedTrajectory,
    predict_trajectory,
)
from irlpilco_ros.learning.state_layout import StateLayout

_MET_SPREAD = 0.05
"""How far a policy's states are taken to stray from the predicted ones [rad, rad/s]."""


@dataclass(frozen=True)
class Evaluation:
    """One evaluation of the objective.

    Attributes:
        policy: The policy that was evaluated.
        trajectory: What it is expected to do.
        cost: The cost of that.
    """

    policy: Policy
    trajectory: PredictedTrajectory
    cost: CostValue

    @property
    def value(self) -> float:
        """J(theta)."""
        return self.cost.value

    def gradient(self) -> Array:
        """Return dJ / d theta, exact, shape (p,)."""
        return self._sweep[0]

    def curvature(self) -> Array:
        """Return an approximate Hessian by theta, positive semidefinite, shape (p, p).

        Gauss-Newton for the predicted means, and what gains do to the spread.
        """
        root = self.cost.curvature_root(self.trajectory.mean_sensitivities())
        curvature = root.T @ root
        spread = self.trajectory.spread_curvature(self._sweep[1])
        return curvature if spread is None else curvature + spread

    def change_metric(self) -> Array | None:
        """Return what changes of the parameters do to the controls, shape (p, p), or None."""
        return self.trajectory.change_metric(_MET_SPREAD)

    @cached_property
    def _sweep(self) -> tuple[Array, Array]:
        return self.trajectory.gradient(self.cost.means_bar, self.cost.covariances_bar)


@dataclass(frozen=True)
class Objective:
    """J(theta): expected cost of a policy in a dynamics model.

    Attributes:
        model: The dynamics model.
        start: State at the start of a trial.
        horizon: Number of steps H.
        layout: What model and policy see of the state.
        cost: What the predicted trajectory costs.
        approximation: "first_order" or "exact", between the outputs of the model.
        noise: Variance of the sensors' noise in what the policy sees, shape (V,); None for none.
    """

    model: Dynamics
    start: Gaussian
    horizon: int
    layout: StateLayout
    cost: Cost
    approximation: CovarianceApproximation = "first_order"
    noise: Array | None = None

    def with_wider_start(self, factor: float) -> Objective:
        """Return the objective of trials that start so many times as far from each other.

        A prediction by moments does not tell that a policy fails in one start of thirty, far from
        where trials usually start. Where those are common, it does.
        """
        start = Gaussian(self.start.mean, factor**2 * self.start.covariance)
        return replace(self, start=start)

    def evaluate(self, policy: Policy, gradient: bool = True) -> Evaluation:
        """Return cost and trajectory of a policy.

        Raises:
            NumericalError: if the prediction is not finite.
        """
        trajectory = predict_trajectory(
            self.model,
            policy,
            self.start,
            self.horizon,
            self.layout,
            approximation=self.approximation,
            gradient=gradient,
            noise=self.noise,
        )
        cost = self.cost.evaluate(trajectory.means, trajectory.covariances)
        return Evaluation(policy, trajectory, cost)

    def value_and_gradient(self, policy: Policy) -> tuple[float, Array]:
        """Return J(theta) and dJ / d theta (p,) in one forward and one reverse sweep."""
        evaluation = self.evaluate(policy)
        return evaluation.value, np.asarray(evaluation.gradient())
