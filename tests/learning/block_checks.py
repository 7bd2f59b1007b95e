"""How building blocks are checked: finite differences, Monte Carlo, and values of the original."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.numerics.arrays import Array

GOLDEN = Path(__file__).resolve().parent.parent / "golden"


def golden_cases(name: str) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Yield (case, inputs, outputs) of tests/golden/NAME.npz, by the names in the file."""
    with np.load(GOLDEN / f"{name}.npz") as stored:
        arrays = dict(stored)
    for case in sorted({key.split("/")[0] for key in arrays}):
        parts = [
            {k.split("/")[2]: v for k, v in arrays.items() if k.startswith(f"{case}/{part}/")}
            for part in ("in", "out")
        ]
        yield case, parts[0], parts[1]


def random_gaussian(rng: np.random.Generator, size: int, spread: float = 0.5) -> Gaussian:
    root = spread * rng.standard_normal((size, size)) / np.sqrt(size)
    return Gaussian(rng.standard_normal(size), root @ root.T + 0.01 * spread**2 * np.eye(size))


def random_bars(rng: np.random.Generator, moments: Moments) -> tuple[Array, Array, Array]:
    covariance_bar = rng.standard_normal(moments.covariance.shape)
    return (
        rng.standard_normal(moments.mean.shape),
        covariance_bar + covariance_bar.T,
        rng.standard_normal(moments.jacobian.shape),
    )


def contract(moments: Moments, bars: tuple[Array, Array, Array]) -> float:
    """Return the scalar whose derivative by the moments is `bars`."""
    parts = (moments.mean, moments.covariance, moments.jacobian)
    return float(sum(np.sum(bar * part) for bar, part in zip(bars, parts, strict=True)))


def slope(function: Callable[..., float], step: float = 2e-3) -> float:
    """Return the derivative at 0 by central differences, extrapolated to sixth order."""
    rough = [(function(h) - function(-h)) / (2 * h) for h in (step, step / 2, step / 4)]
    better = [(4 * rough[i + 1] - rough[i]) / 3 for i in range(2)]
    return (16 * better[1] - better[0]) / 15


def check_pullback(
    block: Callable[[Gaussian], tuple[Moments, Any]], at: Gaussian, jacobian: bool = True
) -> None:
    """Compare a block's pullback with finite differences along random directions."""
    rng = np.random.default_rng(5)
    moments, pullback = block(at)
    bars = random_bars(rng, moments)
    if jacobian:
        mean_bar, covariance_bar = pullback(*bars)[:2]
    else:
        bars = (bars[0], bars[1], 0.0 * bars[2])
        mean_bar, covariance_bar = pullback(*bars[:2])
    np.testing.assert_allclose(covariance_bar, covariance_bar.T, rtol=1e-9, atol=1e-12)
    for _ in range(3):
        change = rng.standard_normal(at.mean.shape)
        root = rng.standard_normal(at.covariance.shape)
        wider = 0.1 * np.trace(at.covariance) / len(root) * (root + root.T)
        found = slope(
            lambda h, c=change: contract(block(Gaussian(at.mean + h * c, at.covariance))[0], bars)
        )
        assert_close(mean_bar @ change, found, np.abs(mean_bar).sum())
        found = slope(
            lambda h, w=wider: contract(block(Gaussian(at.mean, at.covariance + h * w))[0], bars)
        )
        assert_close(np.sum(covariance_bar * wider), found, np.abs(covariance_bar * wider).sum())


def assert_close(value: float, expected: float, size: float, tolerance: float = 1e-6) -> None:
    assert abs(value - expected) <= tolerance * max(abs(expected), 0.1 * size), (value, expected)


def check_monte_carlo(
    moments: Moments,
    at: Gaussian,
    function: Callable[[Array], Array],
    exact: bool = True,
    samples: int = 200_000,
) -> None:
    """Compare moments with samples; by Stein's lemma jacobian @ S = cov(f, x)."""
    rng = np.random.default_rng(11)
    x = rng.multivariate_normal(at.mean, at.covariance, samples)
    y = function(x)
    xs, ys = x - at.mean, y - y.mean(axis=0)
    errors = y.std(axis=0) / np.sqrt(samples)
    bound = 4.5 if exact else 20.0
    assert (np.abs(y.mean(axis=0) - moments.mean) <= bound * errors + 1e-12).all()
    _check_products(ys, ys, moments.covariance, bound)
    _check_products(ys, xs, moments.jacobian @ at.covariance, bound)


def _check_products(a: Array, b: Array, expected: Array, bound: float) -> None:
    n = len(a)
    found = a.T @ b / n
    error = np.sqrt(np.maximum((a**2).T @ (b**2) / n - found**2, 0.0) / n)
    assert (np.abs(found - expected) <= bound * error + 1e-12).all()


def reference_bars(
    out: dict[str, Any], bars: tuple[Array, Array, Array], prefix: str, argument: str
) -> Array:
    """Contract the original's dense derivatives by one argument with adjoints of M, S and C."""
    vectors = (bars[0], bars[1].ravel(order="F"), bars[2].T.ravel(order="F"))
    total: Array = sum(
        out[f"{prefix}d{name}d{argument}"].T @ vector
        for name, vector in zip("MSC", vectors, strict=True)
    )
    return total


def check_golden_block(
    moments: Moments,
    pullback: Any,
    out: dict[str, Any],
    prefix: str = "",
    tolerance: float = 1e-8,
) -> tuple[Array, Array, Array]:
    """Compare moments and pullback with the original's M, S, C and their derivatives."""
    for name, value in (
        ("M", moments.mean[:, None]),
        ("S", moments.covariance),
        ("C", moments.jacobian.T),
    ):
        expected = out[prefix + name]
        np.testing.assert_allclose(
            value, expected, rtol=tolerance, atol=tolerance * np.abs(expected).max()
        )
    bars = random_bars(np.random.default_rng(3), moments)
    pulled = pullback(*bars)
    size = len(pulled[0])
    mean_bar = reference_bars(out, bars, prefix, "m")
    spread_bar = reference_bars(out, bars, prefix, "s").reshape(size, size)
    spread_bar = 0.5 * (spread_bar + spread_bar.T)
    for value, expected in ((pulled[0], mean_bar), (pulled[1], spread_bar)):
        np.testing.assert_allclose(
            value, expected, rtol=tolerance, atol=tolerance * np.abs(expected).max()
        )
    return bars
