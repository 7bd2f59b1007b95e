import numpy as np
import pytest
from block_checks import (
    check_golden_block,
    check_monte_carlo,
    check_pullback,
    golden_cases,
    random_gaussian,
    reference_bars,
)

from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments
from irlpilco_ros.learning.moments.radial_basis import Bumps, bumps_moments, fit_bumps


def some_bumps(outputs=2, dimension=3, count=6):
    rng = np.random.default_rng(0)
    return Bumps(
        rng.standard_normal((count, dimension)),
        rng.standard_normal((outputs, count)),
        rng.uniform(-0.3, 0.6, (outputs, dimension)),
    )


def test_moments_against_monte_carlo():
    bumps, state = some_bumps(), random_gaussian(np.random.default_rng(1), 3)

    def function(x):
        scaled = (x[:, None, None, :] - bumps.centres[None, None]) / np.exp(bumps.log_widths)[
            :, None
        ]
        return np.einsum("an,san->sa", bumps.heights, np.exp(-0.5 * np.sum(scaled**2, axis=3)))

    check_monte_carlo(bumps_moments(bumps, state)[0], state, function, samples=100_000)


def test_gradient_by_the_state():
    check_pullback(
        lambda at: bumps_moments(some_bumps(), at), random_gaussian(np.random.default_rng(2), 3)
    )


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("gp2")))
def test_agrees_with_the_original(case, given, expected):
    """The original's RBF is a GP: its signal is 1 here, its noise the ridge, by scaling both."""
    inputs, outputs = given["X"].shape[1], given["Y"].shape[1]
    signal, noise = np.exp(2.0 * given["hyp"][-2]), np.exp(2.0 * given["hyp"][-1])
    widths = given["hyp"][:inputs].T
    fits = [
        fit_bumps(given["X"], given["Y"][:, [a]], widths[[a]], noise[a] / signal[a])
        for a in range(outputs)
    ]
    bumps = Bumps(given["X"], np.vstack([fit[0].heights for fit in fits]), widths)
    moments, pull = bumps_moments(bumps, Gaussian(given["m"].ravel(), given["S"]))
    floored = Moments(moments.mean, moments.covariance + 1e-6 * np.eye(outputs), moments.jacobian)
    renamed = {name.replace("V", "C"): value for name, value in expected.items()}
    bars = check_golden_block(floored, pull, renamed, tolerance=1e-6)
    bar = pull(*bars)[2]
    parts = [
        fit[1](Bumps(np.zeros_like(given["X"]), bar.heights[[a]], np.zeros((1, inputs))))
        for a, fit in enumerate(fits)
    ]
    centres_bar = bar.centres + sum(part[0] for part in parts)
    targets_bar = np.hstack([part[1] for part in parts])
    widths_bar = bar.log_widths + np.vstack([part[2] for part in parts])
    wanted_hyp = reference_bars(renamed, bars, "", "h").reshape(given["hyp"].shape, order="F")
    for found, wanted in (
        (centres_bar, reference_bars(renamed, bars, "", "i").reshape(given["X"].shape, order="F")),
        (targets_bar, reference_bars(renamed, bars, "", "t").reshape(given["Y"].shape, order="F")),
        (widths_bar, wanted_hyp[:inputs].T),
    ):
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
