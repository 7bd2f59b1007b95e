"""A sparse posterior (FITC) for many points: m inducing points stand for n training points.

Snelson & Ghahramani 2006, as PILCO's gp1 computes it. With Q = K_nm K_mm^-1 K_mn the training
targets have the covariance Q + diag(K - Q) + noise; predictions cost what an exact posterior of
m points costs, however many points there are.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.gp.posterior import Posterior, jitter_notes
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.numerics.linear_algebra import jittered_cholesky, triangular_inverse
from irlpilco_ros.learning.numerics.sharing import for_each_output

_RIDGE = 1e-6


def condition_sparse(
    inputs: Array,
    targets: Array,
    hyperparameters: Hyperparameters,
    inducing: Array,
    ridge: Array | float = _RIDGE,
    threads: int = 1,
) -> Posterior:
    """Condition zero-mean sparse GPs on data, supported by inducing points.

    Args:
        inputs: X, of shape (n, P).
        targets: y, of shape (n, E).
        hyperparameters: Of E outputs and P inputs.
        inducing: Inducing points, of shape (1, m, P) if all outputs share them, else (E, m, P).
        ridge: Added to the diagonal of K_mm, relative to the signal variance; one for all
            outputs or of shape (E,).
        threads: How many threads may work.

    Raises:
        NumericalError: if a kernel matrix is not positive definite whatever the jitter.
    """
    outputs, m = targets.shape[1], inducing.shape[1]
    ridges = np.broadcast_to(ridge, outputs) * hyperparameters.signal_variance
    weights = np.empty((outputs, m))
    inverse = np.empty((outputs, m, m))

    def one_output(a: int) -> float:
        weights[a], inverse[a], jitter = _one_output(
            inputs, targets[:, a], hyperparameters, a, inducing[a % len(inducing)], ridges[a]
        )
        return jitter

    jitters = for_each_output(one_output, outputs, m, threads)
    return Posterior(
        points=np.ascontiguousarray(np.swapaxes(inducing, 1, 2)),
        lengthscales_squared=hyperparameters.lengthscales_squared,
        signal_variance=hyperparameters.signal_variance,
        weights=weights,
        inverse=inverse,
        notes=jitter_notes(jitters),
    )


def _one_output(
    inputs: Array,
    targets: Array,
    hyperparameters: Hyperparameters,
    a: int,
    inducing: Array,
    ridge: float,
) -> tuple[Array, Array, float]:
    """Return beta (m,), the matrix in the place of K^-1 (m, m), and the jitter.

    With K_mm = LL', V = L^-1 K_mn, g = 1 + diag(K - V'V) / noise and
    B = noise I + V diag(1/g) V' = A_m A_m': beta = (L A_m)^-T A_m^-1 V (y/g), and the matrix is
    K_mm^-1 - noise (L B L')^-1.
    """
    lengthscales = np.exp(hyperparameters.log_lengthscales[a])
    signal = float(hyperparameters.signal_variance[a])
    noise = float(hyperparameters.noise_variance[a])
    kernel = squared_exponential(inducing, inducing, lengthscales, signal)
    kernel[np.diag_indices_from(kernel)] += ridge
    factor, jitter = jittered_cholesky(kernel, signal)
    inverse_factor = triangular_inverse(factor)
    v = inverse_factor @ squared_exponential(inducing, inputs, lengthscales, signal)
    g = 1.0 + np.maximum(signal - np.sum(v * v, axis=0), 0.0) / noise
    b = (v / g) @ v.T
    b[np.diag_indices_from(b)] += noise
    b_factor, b_jitter = jittered_cholesky(b, signal)
    b_inverse = triangular_inverse(b_factor)
    combined = b_inverse @ inverse_factor
    weights = combined.T @ (b_inverse @ (v @ (targets / g)))
    inverse = inverse_factor.T @ inverse_factor - noise * (combined.T @ combined)
    return weights, inverse, max(jitter, b_jitter)


def spread_points(inputs: Array, count: int) -> Array:
    """Choose points that cover the data: each the farthest from those chosen before.

    Distances are measured in standard deviations of each input; the first point is the one
    nearest to the mean. Duplicates are never chosen, so there may be fewer than asked for.

    Args:
        inputs: Of shape (n, P).
        count: How many points to choose.

    Returns:
        Indices of the chosen points, of shape (at most count,), in increasing order.
    """
    spread = inputs.std(axis=0)
    scaled = (inputs - inputs.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
    chosen = [int(np.argmin(np.sum(scaled**2, axis=1)))]
    distances = np.full(len(inputs), np.inf)
    while len(chosen) < count:
        distances = np.minimum(distances, np.sum((scaled - scaled[chosen[-1]]) ** 2, axis=1))
        farthest = int(np.argmax(distances))
        if distances[farthest] <= 0.0:
            break
        chosen.append(farthest)
    return np.sort(chosen)
