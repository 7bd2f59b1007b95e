"""The evidence and its gradient: the original's values and finite differences."""

import numpy as np
import pytest
from block_checks import golden_cases, slope
from dynamics_examples import example_data

from irlpilco_ros.learning.gp.evidence import negative_log_evidence
from irlpilco_ros.learning.gp.hyperprior import pilco_penalty


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("nlml")))
def test_agrees_with_the_original(case, given, expected):
    inputs = given["X"]
    log_scales = np.log(inputs.std(axis=0, ddof=1))
    for a in range(given["Y"].shape[1]):
        parameters = given["hyp"][:, a]
        value, gradient = negative_log_evidence(inputs, given["Y"][:, a], parameters)
        penalty, penalty_gradient = pilco_penalty(parameters, log_scales)
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
