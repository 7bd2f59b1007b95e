"""Training of the dynamics model by evidence maximisation (2.28), outputs in parallel."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.dynamics_model import (
    MAX_EXACT_POINTS,
    DynamicsModel,
    check_data,
)
from irlpilco_ros.learning.gp.evidence import negative_log_evidence
from irlpilco_ros.learning.gp.hyperprior import HYPERPRIORS, Belief, Hyperprior
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import useful_threads
from irlpilco_ros.learning.numerics.threads import one_blas_thread, run_parallel

_SMALLEST_SCALE = 1e-8
_LENGTHSCALE_REACH = math.log(100.0) * 1.3  # the soft penalty is at a factor of 100
_SIGNAL_REACH = math.log(1e3)
_NOISE_FLOOR, _NOISE_CEILING = math.log(1e-5), math.log(10.0)


@dataclass(frozen=True)
class _Scales:
    """Logarithms of the data's own scales, which bound the search.

    Attributes:
        inputs: log of the inputs' standard deviations, of shape (P,).
        targets: log of the targets' scales, of shape (E,).
    """

    inputs: Array
    targets: Array

    @staticmethod
    def of(inputs: Array, targets: Array) -> _Scales:
        """Measure the data; what does not vary gets a scale that does no harm."""
        several = len(inputs) > 1
        spread = inputs.std(axis=0, ddof=1) if several else np.zeros(inputs.shape[1])
        spread = np.where(spread > _SMALLEST_SCALE, spread, 1.0)
        height = targets.std(axis=0, ddof=1) if several else np.zeros(targets.shape[1])
        size = np.sqrt(np.mean(targets**2, axis=0))
        height = np.maximum(height, np.maximum(1e-3 * size, _SMALLEST_SCALE))
        return _Scales(np.log(spread), np.log(height))

    def starts(self, belief: Belief) -> list[Array]:
        """Return where cold searches start, [log l, log s, log noise], of shape (E, P + 2) each."""
        lengthscales = np.tile(belief.start(self.inputs), (len(self.targets), 1))
        height = self.targets[:, None]
        return [
            np.hstack([lengthscales, height + math.log(signal), height + math.log(noise)])
            for signal, noise in belief.loudness
        ]

    def bounds(self, a: int) -> Array:
        """Return the box of the search for output a, of shape (P + 2, 2)."""
        height = self.targets[a]
        lower = np.append(
            self.inputs - _LENGTHSCALE_REACH, [height - _SIGNAL_REACH, height + _NOISE_FLOOR]
        )
        upper = np.append(
            self.inputs + _LENGTHSCALE_REACH, [height + _SIGNAL_REACH, height + _NOISE_CEILING]
        )
        return np.stack([lower, upper], axis=1)


def train(
    inputs: Array,
    targets: Array,
    prior_mean: Array | None = None,
    warm_start: Hyperparameters | None = None,
    threads: int = 2,
    progress: Callable[[float], None] | None = None,
    max_evaluations: int = 300,
    max_exact_points: int = MAX_EXACT_POINTS,
    hyperprior: Hyperprior = "pilco",
) -> DynamicsModel:
    """Find the hyperparameters that maximise the evidence, and condition the model on the data.

    Args:
        inputs: [state, control], of shape (n, P).
        targets: Changes of the state, of shape (n, E).
        prior_mean: A of the linear prior mean, of shape (E, P); None for a zero mean.
        warm_start: Hyperparameters to start from, such as the last iteration's; None starts
            from the scales of the data, as PILCO does.
        threads: How many threads may work, if there are enough points; no influence on the result.
        progress: Called with the fraction done, 0..1, from the threads that work, one call at a
            time; may raise to cancel.
        max_evaluations: Of the evidence, for each output.
        max_exact_points: With more points than this, the hyperparameters come from this many
            points, evenly spread over the data in their order, and the model is sparse: see
            `DynamicsModel.condition`.
        hyperprior: What is believed of the hyperparameters before any data. With
            "dimension_scaled" there is a second search, and what has more evidence counts.

    Raises:
        InvalidSettingError: if shapes disagree or the data are not finite.
        NumericalError: if no positive-definite kernel matrix can be found.
    """
    outputs, size = targets.shape[1], inputs.shape[1]
    prior = np.zeros((outputs, size)) if prior_mean is None else prior_mean
    check_data(inputs, targets, prior)
    residuals = targets - inputs @ prior.T
    scales = _Scales.of(inputs, residuals)
    belief = HYPERPRIORS[hyperprior]
    starts = scales.starts(belief)
    if warm_start is not None:
        starts[0] = _stack(warm_start, outputs, size)
    chosen = np.linspace(0, len(inputs) - 1, min(len(inputs), max_exact_points)).astype(int)
    points, values = inputs[chosen], residuals[chosen]
    report = _Progress(progress, outputs)

    def one_output(a: int) -> Array:
        found = _maximise_evidence(
            points,
            values[:, a],
            [start[a] for start in starts],
            scales.bounds(a),
            lambda parameters: belief.penalty(parameters, scales.inputs),
            max_evaluations,
        )
        report.step()
        return found

    threads = useful_threads(len(points), threads)
    with one_blas_thread():
        found = np.array(run_parallel(one_output, range(outputs), threads))
    hyperparameters = Hyperparameters(found[:, :size], found[:, size], found[:, size + 1])
    return DynamicsModel.condition(
        inputs, targets, hyperparameters, prior, threads, max_exact_points
    )


def _maximise_evidence(
    inputs: Array,
    targets: Array,
    starts: Sequence[Array],
    bounds: Array,
    penalty: Callable[[Array], tuple[float, Array]],
    max_evaluations: int,
) -> Array:
    """Return the best parameters [log l, log s, log noise] that L-BFGS finds for one output."""
    from scipy import optimize  # late: it takes as long as all else here

    def objective(parameters: Array) -> tuple[float, Array]:
        value, gradient = negative_log_evidence(inputs, targets, parameters)
        extra, slope = penalty(parameters)
        return value + extra, gradient + slope

    results = [
        optimize.minimize(
            objective,
            np.clip(start, bounds[:, 0], bounds[:, 1]),
            jac=True,
            method="L-BFGS-B",
            bounds=bounds,
            options={"maxfun": max_evaluations, "maxiter": max_evaluations, "maxcor": 20},
        )
        for start in starts
    ]
    best: Array = min(results, key=lambda result: float(result.fun)).x
    return best


def _stack(warm_start: Hyperparameters, outputs: int, size: int) -> Array:
    expected = (outputs, size)
    if warm_start.log_lengthscales.shape != expected:
        raise InvalidSettingError(
            f"warm_start has length-scales of shape {warm_start.log_lengthscales.shape}; "
            f"expected {expected} like the data"
        )
    return np.hstack(
        [
            warm_start.log_lengthscales,
            warm_start.log_signal[:, None],
            warm_start.log_noise[:, None],
        ]
    )


class _Progress:
    """Counts outputs and tells whoever wants to know, one call at a time."""

    def __init__(self, callback: Callable[[float], None] | None, total: int) -> None:
        self._callback = callback
        self._total = total
        self._done = 0
        self._lock = threading.Lock()

    def step(self) -> None:
        if self._callback is None:
            return
        with self._lock:
            self._done += 1
            self._callback(self._done / self._total)
