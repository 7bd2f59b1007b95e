"""Hyperpriors: penalties on the negative log evidence, and where the search for its minimum starts.

`pilco` keeps hyperparameters from running away and is flat in between. With 16 points in 42
dimensions that is not enough: the evidence is largest where some length-scale is tiny, so that
noise looks like structure, and policy search exploits it. `dimension_scaled` expects length-scales
that grow with the typical distance between points, as in C. Hvarfner, E. Hellsten & L. Nardi,
"Vanilla Bayesian Optimization Performs Great in High Dimensions", ICML 2024.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

HyperpriorName: TypeAlias = Literal["dimension_scaled", "pilco"]

_LENGTHSCALE_RANGE = math.log(100.0)
_NOISE_RANGE = math.log(1000.0)
_POWER = 30
_SPREAD = 1.0


def pilco_penalty(parameters: Array, log_scales: Array) -> tuple[float, Array]:
    """Return PILCO's soft penalty on hyperparameters that run away, and its gradient.

    sum_k ((log l_k - log scale_k) / log 100)^30 + ((log s - log noise) / log 1000)^30: flat for
    length-scales within a factor of 100 of the inputs' own scale and signal-to-noise ratios
    below 1000, and steep beyond.

    Args:
        parameters: [log l (P), log s, log noise], of shape (P + 2,).
        log_scales: log of the inputs' standard deviations, of shape (P,).
    """
    ratios = (parameters[:-2] - log_scales) / _LENGTHSCALE_RANGE
    value, gradient = _signal_to_noise_penalty(parameters)
    gradient[:-2] = _POWER * ratios ** (_POWER - 1) / _LENGTHSCALE_RANGE
    return value + float(np.sum(ratios**_POWER)), gradient


def dimension_scaled_penalty(parameters: Array, log_scales: Array) -> tuple[float, Array]:
    """Return -log p(l), up to a constant, with PILCO's limit on signal-to-noise; its gradient.

    log l_k ~ N(log scale_k + sqrt 2 + 1/2 log P, 1): the mean is that of the paper; its spread,
    sqrt 3, leaves more room than 16 points of a 14-joint robot can fill (measured: with spread 1
    errors fell on every seed, see CHANGELOG.md).

    Args:
        parameters: [log l (P), log s, log noise], of shape (P + 2,).
        log_scales: log of the inputs' standard deviations, of shape (P,).
    """
    ratios = (parameters[:-2] - expected_log_lengthscales(log_scales)) / _SPREAD
    value, gradient = _signal_to_noise_penalty(parameters)
    gradient[:-2] = ratios / _SPREAD
    return value + 0.5 * float(ratios @ ratios), gradient


def expected_log_lengthscales(log_scales: Array) -> Array:
    """Return log scale_k + sqrt 2 + 1/2 log P, of shape (P,)."""
    return log_scales + math.sqrt(2.0) + 0.5 * math.log(len(log_scales))


@dataclass(frozen=True)
class Hyperprior:
    """A hyperprior as training needs it.

    Attributes:
        penalty: ([log l, log s, log noise] (P + 2,), log scales (P,)) -> value and gradient.
        lengthscales: log scales (P,) -> log l (P,) at which a cold search starts.
        signal_and_noise: Standard deviations of signal and noise at which each cold search starts,
            relative to the targets' scale; a warm start takes the place of the first.
    """

    penalty: Callable[[Array, Array], tuple[float, Array]]
    lengthscales: Callable[[Array], Array]
    signal_and_noise: tuple[tuple[float, float], ...]


_PILCO_START = (1.0, 0.1)
_HIGH_SIGNAL_TO_NOISE_START = (4.0, 0.04)
"""From PILCO's start some searches end where all is noise, and those of later iterations never
leave it (measured: a joint 20 mrad off for good, 200 nats below what this start finds)."""

HYPERPRIORS: dict[HyperpriorName, Hyperprior] = {
    "dimension_scaled": Hyperprior(
        dimension_scaled_penalty,
        expected_log_lengthscales,
        (_PILCO_START, _HIGH_SIGNAL_TO_NOISE_START),
    ),
    "pilco": Hyperprior(pilco_penalty, lambda log_scales: log_scales, (_PILCO_START,)),
}


def _signal_to_noise_penalty(parameters: Array) -> tuple[float, Array]:
    """Return ((log s - log noise) / log 1000)^30 and its gradient by all parameters."""
    ratio = (parameters[-2] - parameters[-1]) / _NOISE_RANGE
    gradient = np.zeros_like(parameters)
    gradient[-2] = _POWER * ratio ** (_POWER - 1) / _NOISE_RANGE
    gradient[-1] = -gradient[-2]
    return float(ratio**_POWER), gradient
