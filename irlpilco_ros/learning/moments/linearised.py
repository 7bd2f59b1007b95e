"""GPs linearised about the mean of a Gaussian input: value and pullback.

f(x) = f(m) + V (x - m) with f(m) ~ N(M, diag(v)), as an extended Kalman filter takes it (Ko & Fox
2009, "GP-BayesFilters"; Deisenroth 2010, section 2.3.3). What the curvature of f does over the
input's spread is left out: next to nothing while that is small beside the length-scales, as along
a motion that an arm repeats. With z_i = x_i - m, Lambda = diag(l^2) and
q_i = beta_i k_i, k_i = s^2 exp(-1/2 z_i'Lambda^-1 z_i):

    M = sum q                dM/dm = V = Lambda^-1 sum q_i z_i
    v = s^2 - k'K^-1 k       dv/dm = -2 Lambda^-1 sum (K^-1 k)_i k_i z_i
                             dV/dm = Lambda^-1 (sum q_i z_i z_i') Lambda^-1 - M Lambda^-1

so that an output takes one product of K^-1 with a vector, where moment matching takes an n x n
exponential and two n x n x P products.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.gp.posterior import Posterior
from irlpilco_ros.learning.moments.gaussian import Moments, Pullback
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.numerics.sharing import even_slices
from irlpilco_ros.learning.numerics.threads import one_blas_thread, run_parallel

_SMALLEST_VARIANCE = 1e-12  # of the signal variance; what rounding can leave below it
_WORTH_A_THREAD = 1_500_000  # elements of K^-1; one thread has read fewer before another begins


def linearised(
    posterior: Posterior,
    prior_mean: Array,
    mean: Array,
    covariance: Array,
    gradient: bool = True,
    threads: int = 1,
) -> tuple[Moments, Pullback | None]:
    """Return the moments of A x + f(x) for x ~ N(mean, covariance), f linearised about the mean.

    Args:
        posterior: Of f, with E outputs.
        prior_mean: A, of shape (E, P).
        mean: m, of shape (P,).
        covariance: S, of shape (P, P).
        gradient: False leaves out the pullback, which is None then.
        threads: How many threads may work; has no influence on the result.
    """
    covariance = symmetric(covariance)
    with one_blas_thread():
        point = _Point.at(posterior, mean, threads)
    jacobian = point.jacobian + prior_mean
    moments = Moments(
        mean=point.mean + prior_mean @ mean,
        covariance=symmetric(jacobian @ covariance @ jacobian.T) + np.diag(point.variance),
        jacobian=jacobian,
    )

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        C_bar = symmetric(covariance_bar)
        C_bar_J = C_bar @ jacobian
        V_bar = jacobian_bar + 2.0 * C_bar_J @ covariance
        m_bar = prior_mean.T @ mean_bar + point.pull(mean_bar, V_bar, C_bar.diagonal())
        return m_bar, symmetric(jacobian.T @ C_bar_J)

    return moments, pullback if gradient else None


@dataclass(frozen=True)
class _Point:
    """What the posterior says at a point m.

    Attributes:
        inverse_squares: 1 / l^2, of shape (E, P).
        z: Displacements of the supporting points, of shape (G, P, n) with G of 1 or E.
        q: beta_i k_i, of shape (E, n).
        vk: (K^-1 k)_i k_i, of shape (E, n).
        mean: M, of shape (E,).
        variance: v, of shape (E,).
        jacobian: V, of shape (E, P).
        above: Where v is not at its floor, of shape (E,).
    """

    inverse_squares: Array
    z: Array
    q: Array
    vk: Array
    mean: Array
    variance: Array
    jacobian: Array
    above: NDArray[np.bool_]

    @staticmethod
    def at(posterior: Posterior, mean: Array, threads: int) -> _Point:
        """Return it for m of shape (P,)."""
        inverse_squares = 1.0 / posterior.lengthscales_squared
        z = posterior.points - mean[:, None]
        signal = posterior.signal_variance
        k = _forms(inverse_squares, z * z)
        k *= -0.5
        np.exp(k, out=k)
        k *= signal[:, None]
        q = posterior.weights * k
        vk = _solved(posterior.inverse, k, threads)
        vk *= k
        variance, floor = signal - vk.sum(axis=1), _SMALLEST_VARIANCE * signal
        return _Point(
            inverse_squares,
            z,
            q,
            vk,
            q.sum(axis=1),
            np.maximum(variance, floor),
            inverse_squares * _moments(q, z),
            variance > floor,
        )

    def pull(self, mean_bar: Array, jacobian_bar: Array, variance_bar: Array) -> Array:
        """Return the derivative by m (P,), given those by M (E,), V (E, P) and v (E,)."""
        scaled = self.inverse_squares * jacobian_bar
        weights = _forms(scaled, self.z)
        weights += mean_bar[:, None]
        weights *= self.q
        weights -= (2.0 * np.where(self.above, variance_bar, 0.0))[:, None] * self.vk
        m_bar: Array = np.einsum("ep,ep->p", self.inverse_squares, _moments(weights, self.z))
        m_bar -= self.mean @ scaled
        return m_bar


def _forms(vectors: Array, columns: Array) -> Array:
    """Return v'c_i, of shape (E, n), for vectors (E, P) and columns (G, P, n)."""
    if len(columns) == 1:
        return np.asarray(vectors @ columns[0])
    return np.asarray((vectors[:, None] @ columns)[:, 0])


def _moments(weights: Array, columns: Array) -> Array:
    """Return sum_i w_i c_i, of shape (E, P), for weights (E, n) and columns (G, P, n)."""
    if len(columns) == 1:
        return np.asarray(weights @ columns[0].T)
    return np.asarray((columns @ weights[:, :, None])[:, :, 0])


def _solved(inverse: Array, k: Array, threads: int) -> Array:
    """Return K^-1 k, of shape (E, n), which reads all of K^-1: the most of the work."""
    result = np.empty_like(k)

    def one_part(part: slice) -> None:
        np.matmul(inverse[part], k[part, :, None], out=result[part, :, None])

    parts = even_slices(len(k), 2 if inverse.size > _WORTH_A_THREAD else 1)
    run_parallel(one_part, parts, threads)
    return result
