"""The GP's output at a Gaussian input, all outputs together: value and pullback.

With V the expected Jacobian, the covariance of the outputs splits into what the input's spread
explains to first order, V S V', and a remainder R, the Schur complement of the joint covariance
of input and output, hence positive semi-definite:

    first_order:  R = diag(v - diag(V S V'))      so that cov[f_a, f_b] = V_a' S V_b
    exact:        R = C - V S V'                  with the exact covariances C of each pair

A prior mean A x adds A to V and leaves R as it is. A third way matches no moments: `linearised`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.errors import InvalidSettingError, NumericalError
from irlpilco_ros.learning.gp.posterior import Posterior
from irlpilco_ros.learning.moments.displacements import Displacements
from irlpilco_ros.learning.moments.gaussian import Moments, Pullback
from irlpilco_ros.learning.moments.linearised import linearised
from irlpilco_ros.learning.moments.output_moments import OutputGroup, OutputMoments, output_moments
from irlpilco_ros.learning.moments.pair_moments import PairMoments, all_pairs
from irlpilco_ros.learning.numerics.arrays import Array, symmetric
from irlpilco_ros.learning.numerics.sharing import output_groups
from irlpilco_ros.learning.numerics.threads import Deferred, one_blas_thread, run_parallel

CovarianceApproximation: TypeAlias = Literal["linearised", "first_order", "exact"]

_SMALLEST_REMAINDER = 1e-12  # of the signal variance; what rounding can leave below it


@dataclass(frozen=True)
class MomentMatching:
    """The moments of A x + g(x) for Gaussian x; what depends on g alone is prepared once.

    Attributes:
        posterior: Of g, with E outputs.
        prior_mean: A, of shape (E, P).
        threads: How many threads may work; has no influence on the result.
    """

    posterior: Posterior
    prior_mean: Array
    threads: int = 1

    @cached_property
    def _groups(self) -> tuple[OutputGroup, ...]:
        """The outputs in groups that are worked on together, for threads to share out."""
        (_, size, n), outputs = self.posterior.points.shape, self.posterior.outputs
        groups = output_groups(outputs, multiplications=outputs * n * n * size)
        return tuple(OutputGroup.of(self.posterior, which) for which in groups)

    def moments(
        self,
        mean: Array,
        covariance: Array,
        approximation: CovarianceApproximation,
        gradient: bool = True,
    ) -> tuple[Moments, Pullback | None]:
        """Return the moments for x ~ N(mean, covariance), and their pullback.

        Args:
            mean: Of shape (P,).
            covariance: Of shape (P, P).
            approximation: "linearised", "first_order" or "exact".
            gradient: False saves the work for the pullback, which is None then.

        Raises:
            InvalidSettingError: if the approximation or a shape is wrong.
            NumericalError: if the input is not finite or its covariance is indefinite.
        """
        _check_input(self.prior_mean, mean, covariance, approximation)
        if approximation == "linearised":
            return linearised(
                self.posterior, self.prior_mean, mean, covariance, gradient, self.threads
            )
        groups = self._groups
        threads = min(self.threads, len(groups))  # less is not worth sharing
        covariance = symmetric(covariance)
        pairs = None
        with one_blas_thread():
            displacements = Deferred(partial(Displacements.of, self.posterior.points, mean))
            outputs = _Outputs.of(groups, displacements, covariance, gradient, threads)
            if approximation == "exact":
                pairs = all_pairs(
                    self.posterior,
                    displacements.result(),
                    covariance,
                    gradient,
                    len(groups),
                    threads,
                )
        remainder, above = _remainder(self.posterior, outputs, pairs, covariance)
        jacobian = outputs.jacobian + self.prior_mean
        moments = Moments(
            mean=outputs.mean + self.prior_mean @ mean,
            covariance=symmetric(jacobian @ covariance @ jacobian.T + remainder),
            jacobian=jacobian,
        )
        matched = _Matched(self.prior_mean, outputs, pairs, covariance, above, threads)
        return moments, matched.pullback if gradient else None


@dataclass(frozen=True)
class _Outputs:
    """All groups of outputs at one input, and what they say together.

    Attributes:
        groups: Which outputs each has, and their moments.
        mean: M, of shape (E,).
        jacobian: V, of shape (E, P).
        variance: v, of shape (E,).
    """

    groups: list[tuple[slice, OutputMoments]]
    mean: Array
    jacobian: Array
    variance: Array

    @staticmethod
    def of(
        groups: tuple[OutputGroup, ...],
        displacements: Deferred[Displacements],
        covariance: Array,
        gradient: bool,
        threads: int,
    ) -> _Outputs:
        """Return the moments of all groups, which threads share out."""
        found = run_parallel(
            lambda group: output_moments(group, displacements, covariance, gradient, threads),
            groups,
            threads,
        )
        return _Outputs(
            [(group.which, moments) for group, moments in zip(groups, found, strict=True)],
            np.concatenate([moments.mean for moments in found]),
            np.concatenate([moments.jacobian for moments in found]),
            np.concatenate([moments.variance for moments in found]),
        )

    def pullback(
        self, mean_bar: Array, jacobian_bar: Array, variance_bar: Array, threads: int
    ) -> list[tuple[Array, Array]]:
        """Return the pullback of each group by M (E,), V (E, P) and v (E,) to m and S."""

        def pull(part: tuple[slice, OutputMoments]) -> tuple[Array, Array]:
            which, moments = part
            return moments.pullback(mean_bar[which], jacobian_bar[which], variance_bar[which])

        with one_blas_thread():
            return run_parallel(pull, self.groups, threads)


@dataclass(frozen=True)
class _Matched:
    """What the pullback needs of a prediction.

    Attributes:
        prior_mean: A, of shape (E, P).
        outputs: The single outputs.
        pairs: Their exact mean products; None for `first_order`.
        covariance: S, of shape (P, P).
        above: Where the diagonal of R is not at its floor, of shape (E,).
        threads: How many threads may work.
    """

    prior_mean: Array
    outputs: _Outputs
    pairs: PairMoments | None
    covariance: Array
    above: NDArray[np.bool_]
    threads: int

    def pullback(
        self, mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        """Pull derivatives by mean (E,), covariance (E, E) and Jacobian (E, P) back to m and S.

        With C_bar the symmetric part of the covariance's, (A + V) S (A + V)' and R give
        V_bar += 2 (C_bar (A + V) - R_bar V) S     S_bar = (A + V)'C_bar (A + V) - V'R_bar V
        where R_bar = C_bar for `exact` and its diagonal for `first_order`.
        """
        C_bar, V = symmetric(covariance_bar), self.outputs.jacobian
        J = V + self.prior_mean
        variance_bar = np.where(self.above, C_bar.diagonal(), 0.0)
        between_bar = C_bar - np.diag(C_bar.diagonal())  # by what pairs of outputs share
        C_bar_J, R_bar_V = C_bar @ J, variance_bar[:, None] * V
        if self.pairs is not None:
            R_bar_V += between_bar @ V
        V_bar = jacobian_bar + 2.0 * (C_bar_J - R_bar_V) @ self.covariance
        S_bar = J.T @ C_bar_J - V.T @ R_bar_V
        m_bar = self.prior_mean.T @ mean_bar
        if self.pairs is not None:
            mean_bar = mean_bar - 2.0 * between_bar @ self.outputs.mean
            m_part, S_part = self.pairs.pullback(between_bar)
            m_bar, S_bar = m_bar + m_part, S_bar + S_part
        for m_part, S_part in self.outputs.pullback(mean_bar, V_bar, variance_bar, self.threads):
            m_bar, S_bar = m_bar + m_part, S_bar + S_part
        return m_bar, symmetric(S_bar)


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
