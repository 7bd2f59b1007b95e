"""A policy: gains, and a feed-forward that is a polynomial in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy, control_limit, number, parameter
from irlpilco_ros.learning.policies.linear import affine_moments
from irlpilco_ros.learning.settings import setting


@dataclass(frozen=True)
class PolynomialPolicy(Policy):
    """u = squash(W x + C [1, s, s^2, ...]), s = t / H."""

    @dataclass(frozen=True)
    class Settings:
        degree: int = setting(3, "Degree of the polynomial in time.", minimum=0, maximum=9)

    weights: Array = parameter("F D", "Gain of each joint's control on each state dimension.")
    coefficients: Array = parameter("F K", "Coefficients of the feed-forward, constant first.")
    horizon: int = number("Number of control periods of a trial.", minimum=1)
    offset: float = number("Added to s, so that it need not begin at zero.")
    control_limit: Array = control_limit()

    @classmethod
    def zero(cls, task, control_limit, settings):
        """Return the policy that does nothing."""
        F = task.control_size
        coefficients = np.zeros((F, settings.degree + 1))
        return cls(np.zeros((F, task.policy_size)), coefficients, task.horizon, 0.0, control_limit)

    def moments(self, state, step, gradient=True):
        """Return the exact moments of the control at a Gaussian state."""
        s = step / self.horizon + self.offset
        powers = s ** np.arange(self.coefficients.shape[1])
        moments, pull = affine_moments(
            self.weights, self.coefficients @ powers, self.control_limit, state
        )

        def pullback(mean_bar, covariance_bar, jacobian_bar):
            m_bar, S_bar, W_bar, v_bar = pull(mean_bar, covariance_bar, jacobian_bar)
            return m_bar, S_bar, np.concatenate([W_bar.ravel(), np.outer(v_bar, powers).ravel()])

        return moments, pullback if gradient else None
