"""The squared-exponential kernel with automatic relevance determination (2.19)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array

_LARGEST_LOG = 100.0


@dataclass(frozen=True)
class Hyperparameters:
    """Logarithms of the kernel's parameters, one set per output.

    Attributes:
        log_lengthscales: log of the length-scales, in the units of the inputs, shape (E, P).
        log_signal: log of the signal's standard deviation, in units of the output, shape (E,).
        log_noise: log of the noise's standard deviation, in units of the output, shape (E,).
        log_linear: log of the standard deviation of the linear part's coefficients, shape (E,);
            None without a linear part (see `linear_part`).
        log_repeated: log of the standard deviation of what repeats at the same time of every
            trial, in units of the output, shape (E,); None without (see `repeated_part`).

    Raises:
        InvalidSettingError: if shapes disagree or a value is not finite or beyond +-100.
    """

    log_lengthscales: Array
    log_signal: Array
    log_noise: Array
    log_linear: Array | None = None
    log_repeated: Array | None = None

    def __post_init__(self) -> None:
        if self.log_lengthscales.ndim != 2:
            raise InvalidSettingError(
                f"log_lengthscales has shape {self.log_lengthscales.shape}; "
                "expected (outputs, inputs)"
            )
        outputs = (len(self.log_lengthscales),)
        for name in ("log_lengthscales", "log_signal", "log_noise", "log_linear", "log_repeated"):
            value = getattr(self, name)
            if value is None:
                continue
            if name != "log_lengthscales" and value.shape != outputs:
                raise InvalidSettingError(f"{name} has shape {value.shape}; expected {outputs}")
            if not np.all(np.abs(value) <= _LARGEST_LOG):
                raise InvalidSettingError(
                    f"{name} holds a value that is not finite or beyond +-{_LARGEST_LOG:g}; "
                    "these are natural logarithms: check the training data's units"
                )

    @property
    def lengthscales_squared(self) -> Array:
        """Squares of the length-scales, of shape (E, P)."""
        return np.exp(2.0 * self.log_lengthscales)

    @property
    def signal_variance(self) -> Array:
        """Variance of the latent function, of shape (E,)."""
        return np.exp(2.0 * self.log_signal)

    @property
    def noise_variance(self) -> Array:
        """Variance of the observation noise, of shape (E,)."""
        return np.exp(2.0 * self.log_noise)


def squared_exponential(x: Array, y: Array, lengthscales: Array, signal_variance: float) -> Array:
    """Return k(x_i, y_j) = s^2 exp(-1/2 sum_k (x_ik - y_jk)^2 / l_k^2) (2.19).

    Args:
        x: Points, of shape (n, P).
        y: Points, of shape (m, P).
        lengthscales: l, of shape (P,).
        signal_variance: s^2.

    Returns:
        Covariances, of shape (n, m).
    """
    centre = x.mean(axis=0)
    return unit_squared_exponential(
        (x - centre) / lengthscales, (y - centre) / lengthscales, signal_variance
    )


def unit_squared_exponential(a: Array, b: Array, signal_variance: float) -> Array:
    """Return s^2 exp(-1/2 |a_i - b_j|^2), of shape (n, m).

    Args:
        a: Points in units of the length-scales, about zero, of shape (n, P).
        b: Points likewise, of shape (m, P).
        signal_variance: s^2.
    """
    exponent: Array = a @ b.T
    exponent -= 0.5 * np.sum(a * a, axis=1)[:, None]
    exponent -= 0.5 * np.sum(b * b, axis=1)
    np.clip(exponent, -500.0, 0.0, out=exponent)  # rounding above, denormal results below
    np.exp(exponent, out=exponent)
    exponent *= signal_variance
    return exponent
