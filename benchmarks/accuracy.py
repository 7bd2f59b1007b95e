"""What `first_order` and `linearised` cost in accuracy: whole predicted trajectories.

Predictions by them and by `exact` are compared with each other, and both with 100000
Monte-Carlo trajectories of the same model, policy and start. The models are trained with a zero
prior mean, so that the GP has everything to say.
"""

from __future__ import annotations

from typing import get_args

import numpy as np

from benchmarks.problems import arm_objective, sweep_data
from benchmarks.timing import conditions
from irlpilco_ros.learning.gp.kernel import squared_exponential
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.moments.squashing import squash
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.threads import one_blas_thread, run_parallel
from irlpilco_ros.learning.policies import LinearPhasePolicy
from irlpilco_ros.learning.policies.linear_phase import phase_features
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.objective import Objective

SAMPLES = 100_000
CHUNK = 2_000
THREADS = 2
MODELS = ((4, 64, 0.03, True), (14, 16, 0.03, False), (14, 64, 0.001, False), (14, 64, 0.03, True))
"""Joints, points (16 to a trial), spread of the start [rad, rad/s], and whether to sample."""


class SampledModel:
    """The GP as a distribution over outputs at given inputs, independent at every step."""

    def __init__(self, model: DynamicsModel) -> None:
        self.model = model
        hyper = model.hyperparameters
        self.lengthscales = np.exp(hyper.log_lengthscales)
        self.signal = hyper.signal_variance
        self.inverses = [
            np.linalg.inv(
                squared_exponential(model.inputs, model.inputs, lengths, signal)
                + noise * np.eye(len(model.inputs))
            )
            for lengths, signal, noise in zip(
                self.lengthscales, self.signal, hyper.noise_variance, strict=True
            )
        ]

    def sample(self, x: Array, noise: Array) -> Array:
        """Return outputs (m, E) at inputs (m, P), given standard normal numbers (m, E)."""
        result = x @ self.model.prior_mean.T

        def one_output(a: int) -> None:
            for start in range(0, len(x), CHUNK):
                part = slice(start, start + CHUNK)
                k = squared_exponential(
                    x[part], self.model.inputs, self.lengthscales[a], self.signal[a]
                )
                variance = self.signal[a] - np.sum((k @ self.inverses[a]) * k, axis=1)
                result[part, a] += k @ self.model.posterior.weights[a]
                result[part, a] += np.sqrt(np.maximum(variance, 0.0)) * noise[part, a]

        with one_blas_thread():
            run_parallel(one_output, range(len(self.signal)), THREADS)
        return result


def monte_carlo(objective: Objective, policy: LinearPhasePolicy) -> tuple[Array, Array]:
    """Return means and variances (H + 1, D) of sampled trajectories of the same model."""
    rng = np.random.default_rng(4)
    assert isinstance(objective.model, DynamicsModel)
    model, start = SampledModel(objective.model), objective.start
    states = rng.multivariate_normal(start.mean, start.covariance, SAMPLES)
    found = [(states.mean(axis=0), states.var(axis=0))]
    for t in range(objective.horizon):
        bumps = phase_features(t, policy.phase_weights.shape[1], policy.horizon)
        raw = states @ policy.weights.T + policy.phase_weights @ bumps
        x = np.hstack([states, squash(raw, policy.control_limit)])
        states = states + model.sample(x, rng.standard_normal(states.shape))
        found.append((states.mean(axis=0), states.var(axis=0)))
    return np.array([mean for mean, _ in found]), np.array([variance for _, variance in found])


def main() -> None:
    """Print the largest errors over 16 steps and all states."""
    print(conditions())
    print(f"samples alone differ by about {1 / np.sqrt(SAMPLES):.1e} standard deviations")
    print("largest error over 16 steps of         means [st. deviations]  st. deviations [%]")
    for joints, points, spread, sampled in MODELS:
        model = DynamicsModel.train(
            *sweep_data(joints, points), threads=THREADS, max_evaluations=60
        )
        found = {}
        for approximation in get_args(CovarianceApproximation):
            objective, policy = arm_objective(model, approximation, spread=spread)
            trajectory = objective.evaluate(policy, gradient=False).trajectory
            variances = np.diagonal(trajectory.covariances, axis1=1, axis2=2)
            found[approximation] = trajectory.means, variances
        pairs = [("linearised", "exact"), ("first_order", "exact")]
        if sampled:
            found["samples"] = monte_carlo(objective, policy)
            pairs += [("first_order", "samples"), ("exact", "samples")]
        for mine, reference in pairs:
            (means, variances), (true_means, true_variances) = found[mine], found[reference]
            shift = np.abs(means - true_means)[1:] / np.sqrt(true_variances[1:])
            widening = np.abs(np.sqrt(variances[1:] / true_variances[1:]) - 1.0)
            print(
                f"{joints:3d} joints, n = {points}, start {spread:5g}: "
                f"{mine:>11s} - {reference:11s}"
                f"{shift.max():9.1e}{100 * widening.max():19.2f}",
                flush=True,
            )
