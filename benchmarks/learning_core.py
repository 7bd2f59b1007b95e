"""Speed and memory of the learning core, against the floor and against itself.

One objective with its gradient at the size of Baxter's sweep and of the cart-pole; how its cost
grows; training; import.
"""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import time
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from benchmarks.floor import Floor
from benchmarks.problems import (
    HORIZON,
    JOINTS,
    PERIOD,
    arm_hyperparameters,
    arm_model,
    arm_objective,
    cart_pole_objective,
    sweep_data,
    sweep_trials,
)
from benchmarks.timing import conditions, in_turns, peak_megabytes, ratio
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.prediction.trial_data import train_on_trials
from irlpilco_ros.learning.state_layout import StateLayout


@dataclass(frozen=True)
class Case:
    """One line of the table of objectives.

    Attributes:
        name: What it is.
        approximation: Covariances between outputs.
        n: Points.
        rounds: How often to measure.
        bar: Largest ratio to the floor; infinite where none is set.
        aim: Largest time on an idle two-core machine [s].
    """

    name: str
    approximation: CovarianceApproximation
    n: int
    rounds: int
    bar: float
    aim: float

    def problem(self, threads: int) -> tuple[Objective, Policy]:
        """Return the objective and the policy to evaluate."""
        if self.name == "Baxter":
            return arm_objective(arm_model(JOINTS, self.n, threads), self.approximation)
        return cart_pole_objective(self.n, self.approximation, threads)

    def floor(self, threads: int) -> Floor:
        """Return the arithmetic that it cannot do without."""
        outputs, size, steps = (28, 42, HORIZON) if self.name == "Baxter" else (4, 6, 25)
        return Floor(outputs, size, self.n, steps, self.approximation == "exact", threads)


CASES = (
    Case("Baxter", "first_order", 112, 15, 3.0, 0.08),
    Case("Baxter", "first_order", 240, 9, 2.0, 0.2),
    Case("Baxter", "exact", 112, 3, np.inf, 0.6),
    Case("Baxter", "exact", 240, 2, 1.6, 2.0),
    Case("cart-pole", "first_order", 100, 15, np.inf, 0.02),
    Case("cart-pole", "first_order", 200, 15, np.inf, np.inf),
    Case("cart-pole", "exact", 100, 15, np.inf, 0.02),
    Case("cart-pole", "exact", 200, 15, np.inf, np.inf),
)


def print_objectives() -> None:
    """One objective with gradient, against the floor, at the sizes that matter."""
    print(
        "\nobjective + gradient        n  1 thread    floor  x floor   (bar)   value  x value  "
        "2 threads   (aim)  gain  floor's      MB"
    )
    for case in CASES:
        (one, policy), (two, _) = case.problem(1), case.problem(2)
        seconds = in_turns(
            {
                "floor": case.floor(1).run,
                "one": lambda o=one, p=policy: o.value_and_gradient(p),
                "value": lambda o=one, p=policy: o.evaluate(p, gradient=False),
                "floor on two": case.floor(2).run,
                "two": lambda o=two, p=policy: o.value_and_gradient(p),
            },
            case.rounds,
        )
        typical = {name: float(np.median(times)) for name, times in seconds.items()}
        memory = peak_megabytes(lambda o=one, p=policy: o.value_and_gradient(p))
        print(
            f"{case.name:10s}{case.approximation:13s}{case.n:6d}{typical['one']:8.3f} s"
            f"{typical['floor']:7.3f} s{ratio(seconds, 'one', 'floor'):9.2f}{case.bar:8.1f}"
            f"{typical['value']:6.3f} s{ratio(seconds, 'one', 'value'):9.2f}"
            f"{typical['two']:9.3f} s{case.aim:8.2f}{ratio(seconds, 'one', 'two'):6.2f}"
            f"{ratio(seconds, 'floor', 'floor on two'):9.2f}{memory:8.0f}",
            flush=True,
        )


def print_side_by_side() -> None:
    """Two evaluations that share nothing: in two threads, only the lock can keep them waiting."""
    print("\ntwo independent evaluations at once, against one after the other:")
    for case in CASES[:2]:
        (alone,) = _seconds_at_once(case, ThreadPoolExecutor(1), 1)
        threads = _seconds_at_once(case, ThreadPoolExecutor(2), 2)
        spawn = multiprocessing.get_context("spawn")
        processes = _seconds_at_once(case, ProcessPoolExecutor(2, mp_context=spawn), 2)
        print(
            f"  {case.approximation} n = {case.n}: "
            f"in two threads {2.0 * alone / np.mean(threads):.2f}, "
            f"in two processes {2.0 * alone / np.mean(processes):.2f} times as fast",
            flush=True,
        )


def _seconds_at_once(case: Case, pool: Executor, count: int) -> list[float]:
    with pool:
        return list(pool.map(_median_seconds, [case] * count))


def _median_seconds(case: Case) -> float:
    """Return the median time of an evaluation on one thread [s]."""
    objective, policy = case.problem(1)
    seconds = in_turns({"one": lambda: objective.value_and_gradient(policy)}, 30)
    return float(np.median(seconds["one"]))


def print_growth() -> None:
    """Exponents p of seconds ~ n^p, E^p, H^p between the sizes that are named, on one thread."""
    mean, covariance = np.zeros(3 * JOINTS), 0.01 * np.eye(3 * JOINTS)

    def outputs(count: int) -> DynamicsModel:
        inputs, targets = sweep_data(JOINTS, 112)
        hyperparameters = arm_hyperparameters(count, inputs.shape[1])
        return DynamicsModel.condition(inputs, targets[:, :count], hyperparameters)

    models = {f"E {count}": outputs(count) for count in (14, 28)}
    predictions = {name: lambda m=m: m.predict(mean, covariance) for name, m in models.items()}
    pairs = {
        f"{name} exact": lambda m=m: m.predict(mean, covariance, "exact")
        for name, m in models.items()
    }
    objectives = {}
    for name, n, horizon in (("n 60", 60, 16), ("n 240", 240, 16), ("H 8", 60, 8)):
        objective, policy = arm_objective(arm_model(JOINTS, n), "first_order", horizon)
        objectives[name] = lambda o=objective, p=policy: o.value_and_gradient(p)
    sparse = {
        f"sparse {points}": DynamicsModel.condition(
            *sweep_data(4, points), arm_hyperparameters(8, 12)
        )
        for points in (320, 2000)
    }
    sparse_predictions = {
        name: lambda m=m: m.predict(mean[:12], covariance[:12, :12]) for name, m in sparse.items()
    }
    seconds = in_turns(predictions | pairs | objectives | sparse_predictions, 7)
    print("\ngrowth, seconds ~ size^p:")
    for what, large, small, log in (
        ("points n, 60 to 240", "n 240", "n 60", 2.0),
        ("outputs E, 14 to 28, first_order", "E 28", "E 14", 1.0),
        ("outputs E, 14 to 28, exact", "E 28 exact", "E 14 exact", 1.0),
        ("horizon H, 8 to 16", "n 60", "H 8", 1.0),
    ):
        print(f"  {what:38s} p = {np.log2(ratio(seconds, large, small)) / log:.2f}")
    print(
        "  sparse model: a prediction from 2000 points costs "
        f"{ratio(seconds, 'sparse 2000', 'sparse 320'):.2f} times one from 320",
        flush=True,
    )


def print_training() -> None:
    """GP training of 28 outputs, as learning does it."""
    layout, prior = StateLayout(2 * JOINTS), velocity_prior(JOINTS, PERIOD)
    trials = sweep_trials(JOINTS, 7)
    before = train_on_trials(trials[:6], layout, prior, None, threads=2)
    print("\ntraining of 28 outputs, n = 112:")
    for name, warm_start, bar in (("cold", None, 6), ("warm", before.hyperparameters, 3)):
        start = time.perf_counter()
        train_on_trials(trials, layout, prior, warm_start, threads=2)
        print(f"  {name} start: {time.perf_counter() - start:.2f} s (bar {bar} s)", flush=True)


def print_import() -> None:
    """How long `import irlpilco_ros.learning` takes in a new process."""
    code = "import time; t = time.perf_counter(); import irlpilco_ros.learning; "
    seconds = [
        float(
            subprocess.run(
                [sys.executable, "-c", code + "print(time.perf_counter() - t)"],
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
        for _ in range(5)
    ]
    print(f"\nimport of the learning core: {np.median(seconds):.2f} s (bar 0.5 s)", flush=True)


def main() -> None:
    """Print all tables, with the conditions they were measured in."""
    print(conditions())
    print_objectives()
    print_side_by_side()
    print_growth()
    print_training()
    print_import()
