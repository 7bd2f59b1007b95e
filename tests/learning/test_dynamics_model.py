"""Never a bad number: whatever the data and the input, finite values and definite covariances."""

import numpy as np
import pytest
from block_checks import random_bars
from hypothesis import given, settings
from hypothesis import strategies as st

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel

APPROXIMATIONS = st.sampled_from(["linearised", "first_order", "exact"])


def check_prediction(model, mean, covariance, approximation):
    moments, pullback = model.predict(mean, covariance, approximation)
    for part in (moments.mean, moments.covariance, moments.jacobian):
        assert np.isfinite(part).all()
    np.testing.assert_array_equal(moments.covariance, moments.covariance.T)
    values = np.linalg.eigvalsh(moments.covariance)
    assert values.min() > -1e-12 * max(values.max(), 1e-300)
    for bar in pullback(*random_bars(np.random.default_rng(0), moments)):
        assert np.isfinite(bar).all()
    # The joint of input and output must be a covariance too: the next state is made of both.
    cross = moments.jacobian @ covariance
    joint = np.block([[covariance, cross.T], [cross, moments.covariance]])
    values = np.linalg.eigvalsh(joint)
    assert values.min() > -1e-10 * max(values.max(), 1e-300)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(1, 25),
    outputs=st.integers(1, 4),
    inputs=st.integers(1, 5),
    log_lengthscale=st.floats(-6.0, 8.0),
    log_signal=st.floats(-8.0, 5.0),
    log_ratio=st.floats(-7.0, 1.0),
    log_spread=st.floats(-12.0, 5.0),
    rank=st.integers(0, 5),
    far=st.sampled_from([0.0, 1.0, 1e3]),
    approximation=APPROXIMATIONS,
)
def test_given_hyperparameters(
    seed,
    n,
    outputs,
    inputs,
    log_lengthscale,
    log_signal,
    log_ratio,
    log_spread,
    rank,
    far,
    approximation,
):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, inputs))
    x[n // 2 :] = x[: n - n // 2]  # duplicates
    y = np.exp(log_signal) * rng.standard_normal((n, outputs))
    y[:, 0] = y[0, 0]  # constant
    model = DynamicsModel.condition(
        x,
        y,
        Hyperparameters(
            log_lengthscale + rng.standard_normal((outputs, inputs)),
            np.full(outputs, log_signal),
            np.full(outputs, log_signal + log_ratio),
        ),
    )
    root = np.exp(log_spread) * rng.standard_normal((inputs, rank))
    check_prediction(model, far * rng.standard_normal(inputs), root @ root.T, approximation)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(1, 12),
    log_scale=st.floats(-9.0, 9.0),
    kind=st.sampled_from(["zero", "constant", "duplicates", "constant input", "noise", "step"]),
    spread=st.sampled_from([0.0, 1e-6, 0.1, 30.0]),
    approximation=APPROXIMATIONS,
)
def test_trained_on_odd_data(seed, n, log_scale, kind, spread, approximation):
    rng = np.random.default_rng(seed)
    x = np.exp(log_scale) * rng.standard_normal((n, 2))
    y = np.exp(-log_scale) * rng.standard_normal((n, 2))
    if kind == "zero":
        y[:] = 0.0
    elif kind == "constant":
        y[:] = y[0]
    elif kind == "duplicates":
        x[:], y[:] = x[0], y[0]
    elif kind == "constant input":
        x[:, 1] = 3.0
    elif kind == "step":
        y[:, 0] = np.sign(x[:, 0])
    model = DynamicsModel.train(x, y, max_evaluations=25)
    check_prediction(model, x[0], spread**2 * np.exp(2 * log_scale) * np.eye(2), approximation)


def test_a_single_point_is_remembered():
    model = DynamicsModel.train(np.array([[1.0, 2.0]]), np.array([[0.5]]))
    moments, _ = model.predict(np.array([1.0, 2.0]), np.zeros((2, 2)))
    np.testing.assert_allclose(moments.mean, 0.5, rtol=0.05)


def test_absurd_units_are_refused():
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((8, 2)), rng.standard_normal((8, 1))
    with pytest.raises(InvalidSettingError, match=r"training targets hold .*e\+200"):
        DynamicsModel.train(x, np.where(np.arange(8)[:, None] == 3, 1e200, y))
    with pytest.raises(InvalidSettingError, match="training inputs hold inf in row 3, column 1"):
        DynamicsModel.train(np.where(np.arange(16).reshape(8, 2) == 7, np.inf, x), y)


def test_tiny_units_give_numbers():
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((8, 2)), 1e-200 * rng.standard_normal((8, 1))
    check_prediction(DynamicsModel.train(x, y, max_evaluations=10), x[0], 0.01 * np.eye(2), "exact")


def test_a_model_may_expect_what_is_linear_alone():
    """Its mean is the other's linear part; its doubts are its own, and the coefficients'."""
    rng = np.random.default_rng(0)
    x = rng.standard_normal((20, 2))
    y = (0.7 * x[:, :1] + 0.3 * np.sin(3.0 * x[:, 1:])) + 1e-3 * rng.standard_normal((20, 1))
    linear = LinearPart(np.array([[0]]), np.ones((1, 1)))
    both, alone = (
        DynamicsModel.condition(
            x,
            y,
            Hyperparameters(
                np.zeros((1, 2)), np.array([signal]), np.array([-3.0]), np.array([-1.0])
            ),
            linear=linear,
        )
        for signal in (-1.0, -10.0)
    )
    model = both.expecting(alone)
    for at in (x[0], np.array([3.0, -2.0])):
        mean = model.predict(at, np.zeros((2, 2)))[0].mean
        np.testing.assert_allclose(mean, alone.prior_mean @ at, rtol=1e-12)
        spread = model.predict(at, np.zeros((2, 2)))[0].covariance
        doubt = both.predict(at, np.zeros((2, 2)))[0].covariance
        certain = alone.predict(at, np.zeros((2, 2)))[0].covariance
        assert certain < spread
        np.testing.assert_allclose(
            spread - alone.identified.covariance[0] * at[0] ** 2,
            doubt - both.identified.covariance[0] * at[0] ** 2,
        )
    check_prediction(model, x[0], 0.01 * np.eye(2), "exact")
