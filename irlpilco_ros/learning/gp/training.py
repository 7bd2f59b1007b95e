"""Hyperparameters by evidence maximisation (2.28), outputs in parallel."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.evidence import negative_log_evidence
from irlpilco_ros.learning.gp.hyperprior import HYPERPRIORS, Hyperprior, HyperpriorName
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.gp.repeated_part import RepeatedPart
from irlpilco_ros.learning.gp.scaled_part import ScaledPart
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.sharing import for_each_output

_SMALLEST_SCALE = 1e-8
_LENGTHSCALE_RANGE = math.log(100.0) * 1.3  # the soft penalty is at a factor of 100
_SIGNAL_RANGE = math.log(1e3)
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

    def starts(self, hyperprior: Hyperprior) -> list[Array]:
        """Return where cold searches start, [log l, log s, log noise], of shape (E, P + 2) each."""
        lengthscales = np.tile(hyperprior.lengthscales(self.inputs), (len(self.targets), 1))
        height = self.targets[:, None]
        return [
            np.hstack([lengthscales, height + math.log(signal), height + math.log(noise)])
            for signal, noise in hyperprior.signal_and_noise
        ]

    def bounds(self, a: int) -> Array:
        """Return the box of the search for output a, of shape (P + 2, 2)."""
        height = self.targets[a]
        lower = np.append(
            self.inputs - _LENGTHSCALE_RANGE, [height - _SIGNAL_RANGE, height + _NOISE_FLOOR]
        )
        upper = np.append(
            self.inputs + _LENGTHSCALE_RANGE, [height + _SIGNAL_RANGE, height + _NOISE_CEILING]
        )
        return np.stack([lower, upper], axis=1)


def maximise_evidence(
    inputs: Array,
    targets: Array,
    hyperprior: HyperpriorName,
    warm_start: Hyperparameters | None,
    max_points: int,
    max_evaluations: int,
    threads: int,
    progress: Callable[[float], None] | None,
    linear: LinearPart | None = None,
    repeated: RepeatedPart | None = None,
    cold_search: bool = True,
) -> Hyperparameters:
    """Return the hyperparameters of zero-mean GPs that maximise the evidence times the hyperprior.

    Args:
        inputs: Of shape (n, P), finite.
        targets: Of shape (n, E), finite.
        hyperprior: With "dimension_scaled" there is a second search from a higher signal-to-noise
            ratio, and the better end counts.
        warm_start: Where the first search starts; None for the scales of the data, as in PILCO.
        max_points: Of more points than this, so many are used, evenly spread in their order.
        max_evaluations: Of the evidence, for each search.
        threads: How many threads may work; no influence on the result.
        progress: Called with the fraction done, 0..1, from the threads that work, one call at a
            time; may raise to cancel.
        linear: The linear part of the kernel; None for none.
        repeated: To which step of a trial each point belongs; None if nothing repeats.
        cold_search: False leaves out that second search where there is a warm start.

    Raises:
        InvalidSettingError: if the warm start does not fit the data.
        NumericalError: if no positive-definite kernel matrix can be found.
    """
    outputs, size = targets.shape[1], inputs.shape[1]
    prior = HYPERPRIORS[hyperprior]
    scales = _Scales.of(inputs, targets)
    starts = scales.starts(prior)
    if warm_start is not None:
        starts = [_stack(warm_start, outputs, size), *(starts[1:] if cold_search else [])]
    chosen = np.linspace(0, len(inputs) - 1, min(len(inputs), max_points)).astype(int)
    points, values = inputs[chosen], targets[chosen]
    report = _OutputCounter(progress, outputs)

    def parts_of(a: int) -> dict[str, ScaledPart]:
        parts = {}
        if linear is not None:
            parts["log_linear"] = linear.scaled(points, a)
        if repeated is not None:
            parts["log_repeated"] = repeated.scaled(chosen, float(scales.targets[a]))
        return parts

    def one_output(a: int) -> Array:
        parts = parts_of(a)
        found = _search(
            points,
            values[:, a],
            _with_scales([start[a] for start in starts], parts, warm_start, a),
            scales.bounds(a),
            lambda parameters: prior.penalty(parameters, scales.inputs),
            max_evaluations,
            list(parts.values()),
        )
        report.step()
        return found

    found = np.array(for_each_output(one_output, outputs, len(points), threads))
    further = {name: found[:, size + 2 + i] for i, name in enumerate(parts_of(0))}
    return Hyperparameters(found[:, :size], found[:, size], found[:, size + 1], **further)


def _search(
    inputs: Array,
    targets: Array,
    starts: Sequence[Array],
    bounds: Array,
    penalty: Callable[[Array], tuple[float, Array]],
    max_evaluations: int,
    parts: Sequence[ScaledPart],
) -> Array:
    """Return the best parameters [log l, log s, log noise] that L-BFGS finds for one output.

    log b of each further part of the kernel follows them.
    """
    from scipy import optimize  # late: it takes as long as all else here

    kernel = inputs.shape[1] + 2
    bounds = np.vstack([bounds, *(part.bounds for part in parts)])
    grams = [part.gram for part in parts]

    def objective(parameters: Array) -> tuple[float, Array]:
        value, gradient = negative_log_evidence(inputs, targets, parameters, grams)
        extra, slope = penalty(parameters[:kernel])
        gradient[:kernel] += slope
        for number, part in enumerate(parts, kernel):
            more, slope_of_scale = part.penalty(float(parameters[number]))
            extra, gradient[number] = extra + more, gradient[number] + slope_of_scale
        return value + extra, gradient

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


def _with_scales(
    starts: Sequence[Array],
    parts: Mapping[str, ScaledPart],
    warm_start: Hyperparameters | None,
    a: int,
) -> list[Array]:
    """Return starts of output a with log b of each part behind them; the first is the warm one."""
    expected = [part.expected for part in parts.values()]
    known = [None if warm_start is None else getattr(warm_start, name) for name in parts]
    first = [
        value if scale is None else scale[a] for value, scale in zip(expected, known, strict=True)
    ]
    scales = [first, *[expected] * (len(starts) - 1)]
    return [np.append(start, scale) for start, scale in zip(starts, scales, strict=True)]


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


class _OutputCounter:
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
