"""Gaussians, and what a building block makes of a Gaussian input.

Every block of the predicted trajectory (policy, squashing, dynamics model, features) maps a
Gaussian input to `Moments`: the mean and covariance of its output, matched by moments, and the
expected Jacobian, which gives the covariance between input and output by Stein's lemma.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from irlpilco_ros.learning.numerics.arrays import Array

Pullback: TypeAlias = Callable[[Array, Array, Array], tuple[Array, Array]]
"""pullback(mean_bar (k,), covariance_bar (k, k), jacobian_bar (k, n)) ->
(input_mean_bar (n,), input_covariance_bar (n, n), symmetric).

Takes the derivative of a scalar by the block's output, gives the derivative by its input.
A covariance's derivative counts every element of the full matrix (not one triangle); only the
symmetric part of `covariance_bar` has a meaning and only that part is used."""

ParameterPullback: TypeAlias = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""Like `Pullback`, and a third value: the derivative by the block's own parameters (p,)."""


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution N(mean, covariance).

    Attributes:
        mean: Mean, of shape (n,).
        covariance: Covariance, of shape (n, n), symmetric and positive semi-definite.
    """

    mean: Array
    covariance: Array


@dataclass(frozen=True)
class Moments:
    """The output of a block f for an input x ~ N(m, S), matched by moments.

    Attributes:
        mean: E[f(x)], of shape (k,).
        covariance: cov[f(x)], of shape (k, k).
        jacobian: E[df/dx], of shape (k, n); by Stein's lemma cov[f(x), x] = jacobian @ S.
    """

    mean: Array
    covariance: Array
    jacobian: Array
