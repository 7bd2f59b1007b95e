"""The evidence and its gradient: the original's values and finite differences."""

import numpy as np
import pytest
from block_checks import golden_cases, slope
from dynamics_examples import example_data

from irlpilco_ros.learning.evidence import curb, negative_log_evidence


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("nlml")))
def test_agrees_with_the_original(case, given, expected):
    inputs = given["X"]
    log_scales = np.log(inputs.std(axis=0, ddof=1))
    for a in range(given["Y"].shape[1]):
        parameters = given["hyp"][:, a]
        value, gradient = negative_log_evidence(inputs, given["Y"][:, a], parameters)
        penalty, penalty_gradient = curb(parameters, log_scales)
        np.testing.assert_allclose(value, expected["nlml"].ravel()[a], rtol=1e-8)
        np.testing.assert_allclose(gradient, expected["dnlml"][:, a], rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(value + penalty, expected["nlml_curb"].ravel()[a], rtol=1e-8)
        np.testing.assert_allclose(
            gradient + penalty_gradient, expected["dnlml_curb"][:, a], rtol=1e-8, atol=1e-8
        )


@pytest.mark.parametrize("seed", range(4))
def test_gradient(seed):
    rng = np.random.default_rng(seed)
    x, y = example_data(rng, 30, 1, 3)
    parameters = rng.normal([0.5, 0.5, 0.5, 0.0, -1.5], 0.3)
    _, gradient = negative_log_evidence(x, y[:, 0], parameters)
    for k, direction in enumerate(np.eye(5)):
        found = slope(
            lambda h, d=direction: negative_log_evidence(x, y[:, 0], parameters + h * d)[0]
        )
        assert abs(found - gradient[k]) <= 1e-6 * np.abs(gradient).max()


def test_the_curb_is_flat_inside_and_steep_outside():
    scales = np.zeros(2)
    inside = np.array([1.0, -1.0, 0.0, -3.0])
    assert curb(inside, scales)[0] < 1e-10
    for outside in ([6.0, 0.0, 0.0, -3.0], [0.0, -6.0, 0.0, -3.0], [0.0, 0.0, 4.0, -4.0]):
        value, gradient = curb(np.array(outside), scales)
        assert value > 50.0
        for k, direction in enumerate(np.eye(4)):
            found = slope(lambda h, d=direction, o=outside: curb(np.array(o) + h * d, scales)[0])
            np.testing.assert_allclose(gradient[k], found, rtol=1e-6, atol=1e-6)
