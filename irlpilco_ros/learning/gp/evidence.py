"""The evidence of one GP output (2.25-2.27): what training minimises, and its gradient."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from irlpilco_ros.learning.gp.kernel import unit_squared_exponential
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import (
    diagonals,
    jittered_cholesky,
    triangular_inverse,
)


def negative_log_evidence(
    inputs: Array, targets: Array, parameters: Array, grams: Sequence[Array] = ()
) -> tuple[float, Array]:
    """Return -log p(y | X) of a zero-mean GP, and its gradient.

    With alpha = K^-1 y: 1/2 y'alpha + 1/2 log|K| + n/2 log 2 pi. Gradient with
    W = (K^-1 - alpha alpha') * K_f elementwise and z = x / l, in O(n^2 P):
    by log l_k: 1/2 sum_ij W_ij (z_ik - z_jk)^2 = sum_i (W1)_i z_ik^2 - z_k'W z_k;
    by log s: sum W; by log noise: noise^2 (tr K^-1 - alpha'alpha). A further part b^2 G of the
    kernel has b^2 tr((K^-1 - alpha alpha') G) by log b.

    Args:
        inputs: X, of shape (n, P).
        targets: y, of shape (n,).
        parameters: [log l (P), log s, log noise, log b of each further part], of shape
            (P + 2 + G,).
        grams: Further parts of the kernel whose scale alone is sought, such as ZZ' of a linear
            one, each of shape (n, n).

    Raises:
        NumericalError: if K is not positive definite whatever the jitter.
    """
    n, size = inputs.shape
    scaled = inputs * np.exp(-parameters[:size])
    scaled -= scaled.mean(axis=0)
    signal, noise = np.exp(2.0 * parameters[size : size + 2])
    latent = unit_squared_exponential(scaled, scaled, signal)
    kernel = latent.copy()
    diagonals(kernel[None])[...] += noise
    slopes = np.exp(2.0 * parameters[size + 2 :])
    for slope, gram in zip(slopes, grams, strict=True):
        kernel += slope * gram
    factor, _ = jittered_cholesky(kernel, signal)
    inverse_factor = triangular_inverse(factor)
    alpha = inverse_factor.T @ (inverse_factor @ targets)
    value = 0.5 * targets @ alpha + np.log(np.diagonal(factor)).sum()
    value += 0.5 * n * math.log(2.0 * math.pi)

    w = inverse_factor.T @ inverse_factor
    w -= np.outer(alpha, alpha)
    trace = np.trace(w)
    gradient = np.empty(len(parameters))
    for number, (slope, gram) in enumerate(zip(slopes, grams, strict=True), size + 2):
        gradient[number] = slope * np.vdot(w, gram)
    w *= latent
    rows = w.sum(axis=1)
    gradient[:size] = rows @ (scaled * scaled) - np.sum(scaled * (w @ scaled), axis=0)
    gradient[size] = rows.sum()
    gradient[size + 1] = noise * trace
    return float(value), gradient
