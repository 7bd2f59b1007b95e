"""Speed, memory and accuracy of the learning core, as ratios measured in one run.

One objective with its gradient at the size of Baxter's sweep and of the cart-pole, against the
floor of `benchmarks/floor.py`; growth; training; and the error of `first_order`.
"""

from __future__ import annotations

import platform
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from benchmarks.floor import floor_seconds
from irlpilco_ros.learning.costs import FeatureMatching, StateCost
from irlpilco_ros.learning.dynamics_model import DynamicsModel
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.gaussian import Array, Gaussian
from irlpilco_ros.learning.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.objective import Objective
from irlpilco_ros.learning.policies import LinearPhasePolicy, Policy, RbfPolicy
from irlpilco_ros.learning.policies.linear_phase import phase_features
from irlpilco_ros.learning.predicted_trajectory import predict_trajectory
from irlpilco_ros.learning.prior_mean import velocity_prior
from irlpilco_ros.learning.squashing import squash
from irlpilco_ros.learning.state_layout import StateLayout
from irlpilco_ros.learning.threads import one_blas_thread
from irlpilco_ros.learning.training import train

PERIOD = 0.5  # [s]
HORIZON = 16


def sweep_data(joints: int, points: int) -> tuple[Array, Array]:
    """Return inputs and targets of strokes on a robot that lags, with sensor noise."""
    rng = np.random.default_rng(0)
    inputs, targets = [], []
    t = PERIOD * np.arange(HORIZON + 1)[:, None]
    while HORIZON * len(inputs) < points:
        strokes = 2.0 * np.pi / 8.0 * rng.integers(1, 3, joints)
        q = rng.uniform(0.1, 0.5, joints) * np.sin(strokes * t + rng.uniform(0, 6, joints))
        u = np.diff(q, axis=0) / PERIOD
        v = np.vstack([np.zeros((1, joints)), 0.85 * u]) + 5e-3 * rng.standard_normal(q.shape)
        state = np.hstack([q + 4e-4 * rng.standard_normal(q.shape), v])
        inputs.append(np.hstack([state[:-1], u]))
        targets.append(np.diff(state, axis=0))
    return np.vstack(inputs)[:points], np.vstack(targets)[:points]


def arm_hyperparameters(outputs: int, inputs: int) -> Hyperparameters:
    """Return hyperparameters such as training finds for the sweep."""
    rng = np.random.default_rng(1)
    return Hyperparameters(
        np.log(rng.uniform(1.0, 8.0, (outputs, inputs))),
        np.full(outputs, np.log(0.05)),
        np.full(outputs, np.log(0.005)),
    )


def arm_objective(
    joints: int, points: int, method: str, threads: int, horizon: int = HORIZON
) -> tuple[Objective, Policy]:
    """Return the feature-matching objective of a sweep (28 states for 14 joints)."""
    inputs, targets = sweep_data(joints, points)
    model = DynamicsModel.condition(
        inputs,
        targets,
        arm_hyperparameters(2 * joints, 3 * joints),
        velocity_prior(joints, PERIOD),
        threads,
    )
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
    start = Gaussian(np.zeros(2 * joints), 1e-3 * np.eye(2 * joints))
    layout = StateLayout(2 * joints)
    return Objective(model, start, horizon, layout, cost, method), policy


def cart_pole_objective(points: int, method: str, threads: int) -> tuple[Objective, Policy]:
    """Return a saturating objective of cart-pole size: 4 states, 6 inputs, 10 radial bases."""
    rng = np.random.default_rng(3)
    inputs = rng.standard_normal((points, 6))
    targets = 0.2 * np.sin(inputs @ rng.standard_normal((6, 4)))
    model = DynamicsModel.condition(
        inputs, targets, arm_hyperparameters(4, 6), None, threads, max_exact_points=points
    )
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
    return Objective(model, start, 25, layout, cost, method), policy


def best_seconds(function: Callable[[], object], repetitions: int = 3) -> float:
    """Return the best wall time [s] of several runs, BLAS on one thread."""
    best = np.inf
    with one_blas_thread():
        for _ in range(repetitions):
            start = time.perf_counter()
            function()
            best = min(best, time.perf_counter() - start)
    return best


def peak_megabytes(function: Callable[[], object]) -> float:
    """Return how much memory a call holds at its peak [MB]."""
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 1e6


def print_objectives() -> None:
    """One objective with gradient, against the floor, at the sizes that matter."""
    print(
        "objective + gradient     n  threads  seconds  floor  x floor  value s  gradient/value  MB"
    )
    for name, make, shape in (
        ("Baxter first_order", lambda n, t: arm_objective(14, n, "first_order", t), (28, 42, 16)),
        ("Baxter exact", lambda n, t: arm_objective(14, n, "exact", t), (28, 42, 16)),
        (
            "cart-pole first_order",
            lambda n, t: cart_pole_objective(n, "first_order", t),
            (4, 6, 25),
        ),
        ("cart-pole exact", lambda n, t: cart_pole_objective(n, "exact", t), (4, 6, 25)),
    ):
        outputs, inputs, steps = shape
        for n in (112, 240) if outputs == 28 else (100, 200):
            for threads in (1, 2):
                objective, policy = make(n, threads)
                exact = name.endswith("exact")
                runs = 1 if exact and outputs == 28 else 5
                floor = floor_seconds(outputs, inputs, n, steps, exact, threads, runs)
                whole = best_seconds(lambda o=objective, p=policy: o.value_and_gradient(p), runs)
                value = best_seconds(
                    lambda o=objective, p=policy: o.evaluate(p, gradient=False), runs
                )
                memory = peak_megabytes(lambda o=objective, p=policy: o.value_and_gradient(p))
                print(
                    f"{name:22s}{n:5d}{threads:9d}{whole:9.3f}{floor:7.3f}{whole / floor:9.2f}"
                    f"{value:9.3f}{whole / value:16.2f}{memory:4.0f}",
                    flush=True,
                )


def print_growth() -> None:
    """Measured exponents: seconds ~ n^p, E^p, H^p (one thread)."""

    def seconds(joints: int, n: int, horizon: int) -> float:
        objective, policy = arm_objective(joints, n, "first_order", 1, horizon)
        return best_seconds(lambda: objective.value_and_gradient(policy))

    base = seconds(8, 120, 8)
    for name, other in (
        ("points n", seconds(8, 240, 8)),
        ("outputs E (inputs too)", seconds(16, 120, 8)),
        ("horizon H", seconds(8, 120, 16)),
    ):
        print(f"growth with {name}: exponent {np.log2(other / base):.2f}")
    big = DynamicsModel.condition(*sweep_data(4, 2000), arm_hyperparameters(8, 12))
    small = DynamicsModel.condition(*sweep_data(4, 320), arm_hyperparameters(8, 12))
    mean, covariance = np.zeros(12), 0.01 * np.eye(12)
    times = [best_seconds(lambda m=m: m.predict(mean, covariance)) for m in (small, big)]
    print(f"sparse model: 2000 points cost {times[1] / times[0]:.2f} times what 320 cost")


def print_training() -> None:
    """GP training of 28 outputs."""
    inputs, targets = sweep_data(14, 112)
    prior = velocity_prior(14, PERIOD)
    start = time.perf_counter()
    cold = train(inputs[:96], targets[:96], prior, threads=2)
    between = time.perf_counter()
    train(inputs, targets, prior, cold.hyperparameters, threads=2)
    end = time.perf_counter()
    print(f"training 28 outputs: cold, n = 96: {between - start:.2f} s; ", end="")
    print(f"warm, n = 112: {end - between:.2f} s")
    code = "import time; t = time.perf_counter(); import irlpilco_ros.learning.irl_pilco; "
    done = subprocess.run(
        [sys.executable, "-c", code + "print(time.perf_counter() - t)"],
        capture_output=True,
        text=True,
        check=True,
    )
    print(f"import of the learning core: {float(done.stdout):.2f} s")


def monte_carlo(objective: Objective, policy: Policy, samples: int) -> tuple[Array, Array]:
    """Return means and variances (H + 1, D) of sampled trajectories of the same model."""
    rng = np.random.default_rng(4)
    model, start = objective.model, objective.start
    assert isinstance(model, DynamicsModel)
    assert isinstance(policy, LinearPhasePolicy)
    states = rng.multivariate_normal(start.mean, start.covariance, samples)
    moments = [(states.mean(axis=0), states.var(axis=0))]
    hyper, outputs = model.hyperparameters, len(start.mean)
    grams = [
        squared_exponential(
            model.inputs,
            model.inputs,
            np.exp(hyper.log_lengthscales[a]),
            hyper.signal_variance[a],
        )
        + hyper.noise_variance[a] * np.eye(len(model.inputs))
        for a in range(outputs)
    ]
    inverses = [np.linalg.inv(gram) for gram in grams]
    for t in range(objective.horizon):
        bumps = phase_features(t, policy.phase_weights.shape[1], policy.horizon)
        raw = states @ policy.weights.T + policy.phase_weights @ bumps
        x = np.hstack([states, squash(raw, policy.control_limit)])
        change = x @ model.prior_mean.T
        for a in range(outputs):
            k = squared_exponential(
                x, model.inputs, np.exp(hyper.log_lengthscales[a]), hyper.signal_variance[a]
            )
            variance = hyper.signal_variance[a] - np.sum((k @ inverses[a]) * k, axis=1)
            deviation = np.sqrt(np.maximum(variance, 0.0))
            change[:, a] += k @ model.posterior.weights[a]
            change[:, a] += deviation * rng.standard_normal(samples)
        states = states + change
        moments.append((states.mean(axis=0), states.var(axis=0)))
    return np.array([m for m, _ in moments]), np.array([v for _, v in moments])


def print_accuracy() -> None:
    """Predicted means and spreads over a trajectory, `first_order` against `exact` and samples.

    The models are trained with a zero mean, so that the GP has everything to say.
    """
    print("16 steps, largest error of  means [standard deviations]  standard deviations [%]")
    models = {
        joints: train(*sweep_data(joints, points), max_evaluations=60)
        for joints, points in ((4, 48), (14, 112))
    }
    for joints, points in ((4, 48), (14, 112)):
        found = {}
        for method in ("first_order", "exact"):
            objective, policy = arm_objective(joints, points, method, 2)
            objective = replace(objective, model=models[joints])
            with one_blas_thread():
                trajectory = predict_trajectory(
                    objective.model,
                    policy,
                    objective.start,
                    HORIZON,
                    objective.layout,
                    method,
                    gradient=False,
                )
            variances = np.diagonal(trajectory.covariances, axis1=1, axis2=2)
            found[method] = trajectory.means, variances
        pairs = [("first_order", "exact")]
        if joints == 4:
            found["100000 samples"] = monte_carlo(objective, policy, 100_000)
            pairs += [("first_order", "100000 samples"), ("exact", "100000 samples")]
        for mine, reference in pairs:
            means, variances = found[mine]
            true_means, true_variances = found[reference]
            shift = np.abs(means - true_means)[1:] / np.sqrt(true_variances[1:])
            widening = np.abs(np.sqrt(variances[1:] / true_variances[1:]) - 1.0)
            print(
                f"{joints:3d} joints: {mine:>12s} - {reference:15s}{shift.max():14.2e}"
                f"{100 * widening.max():25.2e}",
                flush=True,
            )


def main() -> None:
    """Print all tables, with the conditions they were measured in."""
    print(
        f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, ",
        end="",
    )
    print(f"numpy {np.__version__}, scipy {scipy.__version__}, one BLAS thread per thread")
    print("Other work on this machine distorts the seconds, less so the ratios.")
    print_objectives()
    print_growth()
    print_training()
    print_accuracy()


if __name__ == "__main__":
    main()
