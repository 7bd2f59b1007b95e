"""The problems that are measured: a sweep of Baxter's size, and one of the cart-pole's."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.costs import FeatureMatching, StateCost
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import LinearPhasePolicy, Policy, RbfPolicy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.state_layout import StateLayout

PERIOD = 0.5  # [s]
HORIZON = 16
JOINTS = 14


def sweep_trials(joints: int, trials: int) -> list[Rollout]:
    """Return strokes of a robot that lags, with sensor noise."""
    rng = np.random.default_rng(0)
    t = PERIOD * np.arange(HORIZON + 1)[:, None]
    found = []
    for _ in range(trials):
        strokes = 2.0 * np.pi / 8.0 * rng.integers(1, 3, joints)
        q = rng.uniform(0.1, 0.5, joints) * np.sin(strokes * t + rng.uniform(0, 6, joints))
        u = np.diff(q, axis=0) / PERIOD
        v = np.vstack([np.zeros((1, joints)), 0.85 * u]) + 5e-3 * rng.standard_normal(q.shape)
        found.append(Rollout(np.hstack([q + 4e-4 * rng.standard_normal(q.shape), v]), u))
    return found


def sweep_data(joints: int, points: int) -> tuple[Array, Array]:
    """Return inputs and targets of as many trials as it takes."""
    trials = sweep_trials(joints, -(-points // HORIZON))
    inputs = np.vstack([trial.inputs() for trial in trials])
    targets = np.vstack([trial.increments() for trial in trials])
    return inputs[:points], targets[:points]


def arm_hyperparameters(outputs: int, inputs: int) -> Hyperparameters:
    """Return hyperparameters such as training finds for the sweep."""
    rng = np.random.default_rng(1)
    return Hyperparameters(
        np.log(rng.uniform(1.0, 8.0, (outputs, inputs))),
        np.full(outputs, np.log(0.05)),
        np.full(outputs, np.log(0.005)),
    )


def arm_model(joints: int, points: int, threads: int = 1) -> DynamicsModel:
    """Return a dynamics model of the sweep with given hyperparameters."""
    return DynamicsModel.condition(
        *sweep_data(joints, points),
        arm_hyperparameters(2 * joints, 3 * joints),
        velocity_prior(joints, PERIOD),
        threads,
    )


def arm_objective(
    model: DynamicsModel,
    approximation: CovarianceApproximation,
    horizon: int = HORIZON,
    spread: float = 0.03,
) -> tuple[Objective, LinearPhasePolicy]:
    """Return the feature-matching objective of a sweep (28 states for 14 joints), and a policy."""
    joints = model.targets.shape[1] // 2
    rng = np.random.default_rng(2)
    policy = LinearPhasePolicy(
        0.05 * rng.standard_normal((joints, 2 * joints)),
        0.2 * rng.standard_normal((joints, 8)),
        horizon,
        np.ones(joints),
    )
    cost = FeatureMatching(
        JointPositions(joints), 0.1 * rng.standard_normal((horizon + 1, joints)), np.ones(joints)
    )
    start = Gaussian(np.zeros(2 * joints), spread**2 * np.eye(2 * joints))
    return Objective(model, start, horizon, StateLayout(2 * joints), cost, approximation), policy


def cart_pole_objective(
    points: int, approximation: CovarianceApproximation, threads: int
) -> tuple[Objective, Policy]:
    """Return a saturating objective of cart-pole size: 4 states, 6 inputs, 10 radial bases."""
    rng = np.random.default_rng(3)
    inputs = rng.standard_normal((points, 6))
    targets = 0.2 * np.sin(inputs @ rng.standard_normal((6, 4)))
    model = DynamicsModel.condition(inputs, targets, arm_hyperparameters(4, 6), threads=threads)
    policy = RbfPolicy(
        rng.standard_normal((10, 5)),
        rng.standard_normal((10, 1)),
        np.zeros((1, 5)),
        np.array([10.0]),
    )
    seen = (0, 1, 2, 4, 5)
    layout = StateLayout(4, angles=(3,), dynamics_inputs=seen, policy_inputs=seen)
    cost = StateCost(JointPositions(4), np.zeros(4), np.eye(4))
    start = Gaussian(np.zeros(4), 0.01 * np.eye(4))
    return Objective(model, start, 25, layout, cost, approximation), policy
