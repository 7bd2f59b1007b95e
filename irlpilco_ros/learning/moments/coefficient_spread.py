"""What is not known of linear coefficients, in the moments of a prediction.

With coefficients N(a, C) for z, a part of the input x ~ N(m, S), a prediction's variance has
E[z'C z] = m'C m + tr(C S) more than with the coefficients a.
"""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.gp.linear_part import Identified
from irlpilco_ros.learning.moments.gaussian import Moments, Pullback
from irlpilco_ros.learning.numerics.arrays import Array


def widened(
    identified: Identified,
    moments: Moments,
    pull: Pullback | None,
    mean: Array,
    covariance: Array,
    step: int | None = None,
) -> tuple[Moments, Pullback | None]:
    """Return moments, and their pullback, with what is not known of the coefficients.

    Args:
        identified: The coefficients of each output.
        moments: For coefficients that are known.
        pull: Theirs; None without gradient.
        mean: Of the input, shape (P,).
        covariance: Of the input, shape (P, P).
        step: Of a trial, for what repeats there; None for no trial's.
    """
    known, spread = identified.columns, identified.covariance
    rows, columns = known[:, :, None], known[:, None, :]
    by_mean = np.einsum("ekl,el->ek", spread, mean[known])
    extra = np.einsum("ek,ek->e", by_mean, mean[known])
    extra += np.einsum("ekl,ekl->e", spread, covariance[rows, columns])
    middle = moments.mean
    if step is not None and step < len(identified.repeated):
        middle = middle + identified.repeated[step]
        extra += identified.repeated_variance[step]
    wider = Moments(middle, moments.covariance + np.diag(extra), moments.jacobian)

    def pullback(
        mean_bar: Array, covariance_bar: Array, jacobian_bar: Array
    ) -> tuple[Array, Array]:
        assert pull is not None
        m_bar, S_bar = pull(mean_bar, covariance_bar, jacobian_bar)
        variance_bar = covariance_bar.diagonal()
        np.add.at(m_bar, known, 2.0 * variance_bar[:, None] * by_mean)
        np.add.at(S_bar, (rows, columns), variance_bar[:, None, None] * spread)
        return m_bar, S_bar

    return wider, pullback if pull is not None else None
