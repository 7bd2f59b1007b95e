"""The GP's output at a Gaussian input, all outputs together: value and pullback.

With V the expected Jacobian, the covariance of the outputs splits into what the input's spread
explains to first order, V S V', and a remainder R, the Schur complement of the joint covariance
of input and output, hence positive semi-definite:

    first_order:  R = diag(v - diag(V S V'))      so that cov[f_a, f_b] = V_a' S V_b
    exact:        R = C - V S V'                  with the exact covariances C of each pair

A prior mean A x adds A to V and leaves R as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.errors import InvalidSettingError, NumericalError
from irlpilco_ros.learning.gp.posterior import Posterior
from irlpilco_ros.learning.moments.displacements import Displacements
from irlpilco_ros.learning.moments.gaussian import Moments, Pullback
from irlpilco_ros.learning.moments.output_moments import OutputMoments, output_moments
from irlpilco_ros.learning.moments.pair_moments import PairMoments, all_pairs
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.numerics.threads import Task, one_blas_thread, run_parallel

CovarianceApproximation: TypeAlias = Literal["first_order", "exact"]

_SMALLEST_REMAINDER = 1e-12  # of the signal variance; what rounding can leave below it


@dataclass(frozen=True)
class _Outputs:
    """All groups of outputs at one input, and what they say together."""

    groups: list[OutputMoments]
    mean: Array
    jacobian: Array
    variance: Array


def match_moments(
    posterior: Posterior,
    prior_mean: Array,
    mean: Array,
    covariance: Array,
    approximation: CovarianceApproximation,
    gradient: bool,
    threads: int,
) -> tuple[Moments, Pullback | None]:
    """Return the moments of A x + g(x) for x ~ N(mean, covariance), and their pullback.

    Args:
        posterior: Of g, with E outputs.
        prior_mean: A, of shape (E, P).
        mean: Of shape (P,).
        covariance: Of shape (P, P).
        approximation: "first_order" or "exact".
        gradient: False saves the work for the pullback, which is None then.
        threads: How many threads may work.

    Raises:
        InvalidSettingError: if the approximation or a shape is wrong.
        NumericalError: if the input is not finite or its covariance is indefinite.
    """
    _check_input(prior_mean, mean, covariance, approximation)
    threads = min(threads, len(posterior.groups))  # less is not worth sharing
    covariance = symmetric(covariance)
    pairs = None
    with one_blas_thread():
        displacements = Task(partial(Displacements.of, posterior.points, mean))
        outputs = _all_outputs(posterior, displacements, covariance, gradient, threads)
        if approximation == "exact":
            pairs = all_pairs(posterior, displacements.result(), covariance, gradient, threads)
    remainder, above = _remainder(posterior, outputs, pairs, covariance)
    jacobian = outputs.jacobian + prior_mean
    moments = Moments(
        mean=outputs.mean + prior_mean @ mean,
        covariance=symmetric(jacobian @ covariance @ jacobian.T + remainder),
        jacobian=jacobian,
    )
    matched = _Matched(posterior, outputs, pairs, prior_mean, covariance, above, threads)
    return moments, matched.pullback if gradient else None


@dataclass(frozen=True)
class _Matched:
    """What the pullback needs of a prediction.

    Attributes:
        posterior: Of g.
        outputs: The single outputs.
        pairs: Their exact mean products; None for `first_order`.
        prior_mean: A, of shape (E, P).
        covariance: S, of shape (P, P).
        above: Where the diagonal of R is not at its floor, of shape (E,).
        threads: How many threads may work.
    """

    posterior: Posterior
    outputs: _Outputs
    pairs: PairMoments | None
    prior_mean: Array
    covariance: Array
    above: NDArray[np.bool_]
    threads: int

    def pullback(
        self, mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        """Pull derivatives by mean (E,), covariance (E, E) and Jacobian (E, P) back to m and S."""
        bar, own = symmetric(covariance_bar), self.outputs.jacobian
        jacobian = own + self.prior_mean
        diagonal = bar.diagonal()
        # Through (A + V) S (A + V)', and through R: variances and pairs, minus V S V'.
        variance_bar = np.where(self.above, diagonal, 0.0)
        turned, taken = bar @ jacobian, variance_bar[:, None] * own
        if self.pairs is not None:
            taken += (bar - np.diag(diagonal)) @ own
        jacobian_total = jacobian_bar + 2.0 * (turned - taken) @ self.covariance
        s_bar = jacobian.T @ turned - own.T @ taken
        m_bar = self.prior_mean.T @ mean_bar
        if self.pairs is not None:
            between = bar - np.diag(np.diagonal(bar))
            mean_bar = mean_bar - 2.0 * between @ self.outputs.mean
            m_part, s_part = self.pairs.pullback(between)
            m_bar, s_bar = m_bar + m_part, s_bar + s_part
        for m_part, s_part in self._pull_outputs(mean_bar, jacobian_total, variance_bar):
            m_bar, s_bar = m_bar + m_part, s_bar + s_part
        return m_bar, symmetric(s_bar)

    def _pull_outputs(
        self, mean_bar: Array, jacobian_bar: Array, variance_bar: Array
    ) -> list[tuple[Array, Array]]:
        """Return the pullback of each group of outputs."""

        def pull(part: tuple[slice, OutputMoments]) -> tuple[Array, Array]:
            which, group = part
            return group.pullback(mean_bar[which], jacobian_bar[which], variance_bar[which])

        parts = list(zip(self.posterior.groups, self.outputs.groups, strict=True))
        with one_blas_thread():
            return run_parallel(pull, parts, self.threads)


def _remainder(
    posterior: Posterior, outputs: _Outputs, pairs: PairMoments | None, covariance: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Return R (E, E), and where its diagonal is above what rounding can leave (E,)."""
    explained = outputs.jacobian @ covariance @ outputs.jacobian.T
    floor = _SMALLEST_REMAINDER * posterior.signal_variance
    unexplained = outputs.variance - np.diagonal(explained)
    above = unexplained > floor
    diagonal = np.where(above, unexplained, floor)
    if pairs is None:
        return np.diag(diagonal), above
    covariances = pairs.products - np.outer(outputs.mean, outputs.mean)
    return _definite(covariances - explained, diagonal, posterior), above


def _all_outputs(
    posterior: Posterior,
    displacements: Task[Displacements],
    covariance: Array,
    gradient: bool,
    threads: int,
) -> _Outputs:
    groups = run_parallel(
        lambda group: output_moments(
            posterior, group, displacements, covariance, gradient, threads
        ),
        posterior.groups,
        threads,
    )
    return _Outputs(
        groups,
        np.concatenate([group.mean for group in groups]),
        np.concatenate([group.jacobian for group in groups]),
        np.concatenate([group.variance for group in groups]),
    )


def _definite(remainder: Array, diagonal: Array, posterior: Posterior) -> Array:
    """Put the guarded diagonal in, and lift it until rounding cannot make R indefinite.

    The lift is a constant: it has no derivative.
    """
    result = remainder.copy()
    np.fill_diagonal(result, diagonal)
    lift = _SMALLEST_REMAINDER * posterior.signal_variance
    for _ in range(12):
        try:
            np.linalg.cholesky(result)
        except np.linalg.LinAlgError:
            result[np.diag_indices_from(result)] += lift
            lift = 10.0 * lift
        else:
            return result
    raise NumericalError(
        "the predicted covariance is not positive definite: rounding errors exceed the signal "
        "variance; the hyperparameters are too extreme for the data, train them again"
    )


def _check_input(prior_mean: Array, mean: Array, covariance: Array, approximation: str) -> None:
    size = prior_mean.shape[1]
    if approximation not in get_args(CovarianceApproximation):
        valid = ", ".join(get_args(CovarianceApproximation))
        raise InvalidSettingError(f"approximation is {approximation!r}; valid: {valid}")
    if mean.shape != (size,) or covariance.shape != (size, size):
        raise InvalidSettingError(
            f"the input's mean has shape {mean.shape} and its covariance {covariance.shape}; "
            f"expected {(size,)} and {(size, size)}"
        )
    if not (np.all(np.isfinite(mean)) and np.all(np.isfinite(covariance))):
        raise NumericalError(
            "the input of the dynamics model is not finite; the predicted trajectory before it "
            "has diverged: use smaller policy parameters"
        )
