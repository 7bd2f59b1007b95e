"""Small dynamics models for tests: smooth data, moderate noise, own length-scales per output."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel


def example_hyperparameters(rng, outputs, inputs):
    return Hyperparameters(
        np.log(rng.uniform(1.0, 4.0, (outputs, inputs))),
        np.log(rng.uniform(0.5, 2.0, outputs)),
        np.log(rng.uniform(0.3, 0.5, outputs)),
    )


def example_data(rng, n, outputs, inputs):
    x = rng.standard_normal((n, inputs))
    y = np.sin(x @ rng.standard_normal((inputs, outputs))) + 0.1 * rng.standard_normal((n, outputs))
    return x, y


def example_model(seed=0, n=20, outputs=3, inputs=4, prior=False, **options):
    rng = np.random.default_rng(seed)
    x, y = example_data(rng, n, outputs, inputs)
    prior_mean = 0.3 * rng.standard_normal((outputs, inputs)) if prior else None
    hyperparameters = example_hyperparameters(rng, outputs, inputs)
    return DynamicsModel.condition(x, y, hyperparameters, prior_mean, **options)


def example_input(seed, size, spread=0.5):
    rng = np.random.default_rng(seed)
    root = spread * rng.standard_normal((size, size)) / np.sqrt(size)
    return Gaussian(0.5 * rng.standard_normal(size), root @ root.T)
