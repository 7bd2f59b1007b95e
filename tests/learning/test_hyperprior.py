"""Hyperpriors: gradients, where they are flat and what they prevent."""

import math

import numpy as np
import pytest
from block_checks import slope

from irlpilco_ros.learning.gp.hyperprior import HYPERPRIORS, dimension_scaled_penalty, pilco_penalty
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel


@pytest.mark.parametrize("name", sorted(HYPERPRIORS))
@pytest.mark.parametrize(
    "parameters", [[6.0, 0.0, 0.0, -3.0], [0.0, -6.0, 0.0, -3.0], [0.3, -0.2, 4.0, -4.0]]
)
def test_gradient(name, parameters):
    scales, parameters = np.array([0.1, -0.4]), np.array(parameters)
    _, gradient = HYPERPRIORS[name].penalty(parameters, scales)
    for k, direction in enumerate(np.eye(4)):
        found = slope(
            lambda h, d=direction: HYPERPRIORS[name].penalty(parameters + h * d, scales)[0]
        )
        np.testing.assert_allclose(gradient[k], found, rtol=1e-6, atol=1e-6)


def test_the_penalty_is_flat_inside_and_steep_outside():
    scales = np.zeros(2)
    assert pilco_penalty(np.array([1.0, -1.0, 0.0, -3.0]), scales)[0] < 1e-10
    for outside in ([6.0, 0.0, 0.0, -3.0], [0.0, -6.0, 0.0, -3.0], [0.0, 0.0, 4.0, -4.0]):
        assert pilco_penalty(np.array(outside), scales)[0] > 50.0


@pytest.mark.parametrize("inputs", [1, 6, 42])
def test_the_expected_lengthscale_grows_with_the_dimensions(inputs):
    scales = np.linspace(-2.0, 1.0, inputs)
    expected = scales + math.sqrt(2.0) + 0.5 * math.log(inputs)
    value, gradient = dimension_scaled_penalty(np.append(expected, [0.0, -3.0]), scales)
    assert value < 1e-10
    assert np.abs(gradient[:-2]).max() == 0.0


def test_noise_is_not_taken_for_structure():
    rng = np.random.default_rng(0)
    inputs, noise = rng.normal(size=(16, 42)), rng.normal(size=(16, 6))
    fresh = rng.normal(size=42)
    trusted = {}
    for name in HYPERPRIORS:
        model = DynamicsModel.train(inputs, noise, threads=1, hyperprior=name)
        lengthscales = np.exp(model.hyperparameters.log_lengthscales)
        assert np.isfinite(model.predict(fresh, np.zeros((42, 42)))[0].mean).all()
        trusted[name] = lengthscales.min(axis=1)
    assert (trusted["dimension_scaled"] > 1.0).all()
    assert (trusted["pilco"] < 1.0).any()
