"""Factors and inverses of stacks of matrices."""

import numpy as np
import pytest

from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.numerics.linear_algebra import (
    jittered_cholesky,
    regularised_inverse,
    triangular_inverse,
)


@pytest.mark.parametrize("size", [1, 2, 6, 7, 13, 42, 65, 112])
def test_triangular_inverse(size):
    rng = np.random.default_rng(size)
    factor = np.tril(rng.standard_normal((3, size, size))) / np.sqrt(size) + 2.0 * np.eye(size)
    inverse = triangular_inverse(factor)
    np.testing.assert_allclose(factor @ inverse, np.tile(np.eye(size), (3, 1, 1)), atol=1e-11)
    np.testing.assert_array_equal(inverse, np.tril(inverse))


def test_regularised_inverse_over_many_magnitudes():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((5, 2))
    covariance = root @ root.T
    for regulariser in (np.full((1, 5), 0.5), np.exp(rng.uniform(-20, 20, (3, 5)))):
        inverse, log_determinant = regularised_inverse(covariance, regulariser)
        for one, d, logarithm in zip(inverse, regulariser, log_determinant, strict=True):
            expected = np.linalg.slogdet(np.eye(5) + covariance / np.sqrt(np.outer(d, d)))[1]
            np.testing.assert_allclose(logarithm, expected, rtol=1e-6)
            product = one @ (covariance + np.diag(d))
            np.testing.assert_allclose(
                product, np.eye(5), atol=1e-6 * np.abs(one).max() * np.abs(covariance).max() + 1e-9
            )


def test_regularised_inverse_without_covariance():
    inverse, log_determinant = regularised_inverse(np.zeros((2, 2)), np.array([[4.0, 0.5]]))
    np.testing.assert_allclose(inverse[0], np.diag([0.25, 2.0]))
    assert abs(log_determinant[0]) < 1e-15


def test_jitter_escalates_until_it_suffices():
    definite = np.diag([1.0, 2.0])
    factor, jitter = jittered_cholesky(definite, 1.0)
    assert jitter == 0.0
    np.testing.assert_allclose(factor @ factor.T, definite)
    indefinite = np.diag([1.0, -1e-5])
    factor, jitter = jittered_cholesky(indefinite, 1.0)
    assert 1e-5 < jitter <= 1.01e-4
    np.testing.assert_allclose(factor @ factor.T, indefinite + jitter * np.eye(2))


@pytest.mark.parametrize("matrix", [-np.eye(3), np.full((3, 3), np.nan)])
def test_hopeless_matrices_are_refused(matrix):
    with pytest.raises(NumericalError, match="3 points is not positive definite"):
        jittered_cholesky(matrix, 1.0)
