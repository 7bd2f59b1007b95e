"""Training: the original's optima, warm starts, threads, progress, odd data."""

from functools import partial

import numpy as np
import pytest
from block_checks import golden_cases
from dynamics_examples import example_data, example_hyperparameters

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.evidence import negative_log_evidence
from irlpilco_ros.learning.gp.hyperprior import dimension_scaled_penalty, pilco_penalty
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel


def evidence(penalty, inputs, targets, hyperparameters, a):
    parameters = np.concatenate(
        [
            hyperparameters.log_lengthscales[a],
            [hyperparameters.log_signal[a], hyperparameters.log_noise[a]],
        ]
    )
    value = negative_log_evidence(inputs, targets[:, a], parameters)[0]
    return value + penalty(parameters, np.log(inputs.std(axis=0, ddof=1)))[0]


pilco_evidence = partial(evidence, pilco_penalty)
scaled_evidence = partial(evidence, dimension_scaled_penalty)


@pytest.mark.parametrize(("case", "given", "expected"), list(golden_cases("train")))
def test_finds_the_optima_of_the_original(case, given, expected):
    model = DynamicsModel.train(given["X"], given["Y"])
    for a, value in enumerate(expected["nlml"].ravel()):
        found = pilco_evidence(given["X"], given["Y"], model.hyperparameters, a)
        assert found <= value + 1e-3 * abs(value)


def test_recovers_the_parameters_that_made_the_data():
    rng = np.random.default_rng(0)
    x = rng.uniform(-4.0, 4.0, (150, 2))
    truth = np.array([1.0, 2.0])
    scaled = x / truth
    gram = np.exp(-0.5 * ((scaled[:, None] - scaled[None]) ** 2).sum(axis=2))
    y = np.linalg.cholesky(gram + 1e-9 * np.eye(150)) @ rng.standard_normal(150)
    y += 0.1 * rng.standard_normal(150)
    found = DynamicsModel.train(x, y[:, None]).hyperparameters
    np.testing.assert_allclose(np.exp(found.log_lengthscales[0]), truth, rtol=0.25)
    np.testing.assert_allclose(np.exp(found.log_noise), 0.1, rtol=0.25)


def test_threads_do_not_change_a_bit():
    rng = np.random.default_rng(1)
    x, y = example_data(rng, 200, 5, 3)  # enough for threads to be used
    models = [
        DynamicsModel.train(x, y, threads=threads, max_evaluations=30) for threads in (1, 2, 3)
    ]
    for model in models[1:]:
        for name in ("log_lengthscales", "log_signal", "log_noise"):
            np.testing.assert_array_equal(
                getattr(model.hyperparameters, name), getattr(models[0].hyperparameters, name)
            )
        np.testing.assert_array_equal(model.posterior.weights, models[0].posterior.weights)


def test_warm_start_needs_fewer_evaluations():
    rng = np.random.default_rng(2)
    x, y = example_data(rng, 60, 2, 3)
    before = DynamicsModel.train(x[:50], y[:50]).hyperparameters
    best = DynamicsModel.train(x, y).hyperparameters
    warm = DynamicsModel.train(x, y, warm_start=before, max_evaluations=10).hyperparameters
    cold = DynamicsModel.train(x, y, max_evaluations=10).hyperparameters
    for a in range(2):
        lost = [pilco_evidence(x, y, h, a) - pilco_evidence(x, y, best, a) for h in (warm, cold)]
        assert lost[0] <= max(0.2 * lost[1], 1e-3)


def test_a_warm_start_where_all_is_noise_is_left():
    rng = np.random.default_rng(2)
    x = rng.standard_normal((40, 3))
    y = np.sin(0.5 * x @ rng.standard_normal((3, 2))) + 0.01 * rng.standard_normal((40, 2))
    cold = DynamicsModel.train(x, y, hyperprior="dimension_scaled")
    quiet, loud = np.log(1e-2 * y.std(axis=0)), np.log(y.std(axis=0))
    trap = Hyperparameters(np.full((2, 3), 3.0), quiet, loud)
    found = DynamicsModel.train(
        x, y, warm_start=trap, max_evaluations=40, hyperprior="dimension_scaled"
    )
    for a in range(2):
        best, reached, start = (
            scaled_evidence(x, y, each, a)
            for each in (cold.hyperparameters, found.hyperparameters, trap)
        )
        assert start > best + 20.0
        assert reached < best + 1.0


def test_without_the_cold_search_a_warm_start_is_all_there_is():
    """It stays in the trap that the search beside it leaves, and takes fewer evaluations."""
    rng = np.random.default_rng(2)
    x = rng.standard_normal((40, 3))
    y = np.sin(0.5 * x @ rng.standard_normal((3, 2))) + 0.01 * rng.standard_normal((40, 2))
    trap = Hyperparameters(np.full((2, 3), 3.0), np.log(1e-2 * y.std(0)), np.log(y.std(0)))
    both, alone = (
        DynamicsModel.train(
            x,
            y,
            warm_start=trap,
            max_evaluations=40,
            hyperprior="dimension_scaled",
            cold_search=cold_search,
        ).hyperparameters
        for cold_search in (True, False)
    )
    for a in range(2):
        assert scaled_evidence(x, y, alone, a) > scaled_evidence(x, y, both, a) + 1.0


def test_the_prior_mean_is_taken_off_first():
    rng = np.random.default_rng(3)
    x = rng.standard_normal((30, 6))
    prior = velocity_prior(2, 0.5)
    y = x @ prior.T + 1e-3 * np.sin(x[:, :4])
    model = DynamicsModel.train(x, y, prior_mean=prior)
    assert (model.hyperparameters.signal_variance < 1e-4).all()
    moments, _ = model.predict(x[0], np.zeros((6, 6)))
    np.testing.assert_allclose(moments.mean, y[0], atol=2e-4)


def test_progress_reaches_one_and_may_cancel():
    rng = np.random.default_rng(4)
    x, y = example_data(rng, 15, 4, 2)
    seen = []
    DynamicsModel.train(x, y, progress=seen.append, max_evaluations=5)
    assert seen == [0.25, 0.5, 0.75, 1.0]

    class CancelledError(Exception):
        pass

    def cancel(fraction):
        raise CancelledError

    with pytest.raises(CancelledError):
        DynamicsModel.train(x, y, progress=cancel, max_evaluations=5)


def test_jitter_is_reported_and_not_printed(capsys):
    x = np.repeat(np.array([[0.0], [1.0]]), 10, axis=0)
    y = np.repeat(np.array([[0.0], [1.0]]), 10, axis=0)
    tiny = Hyperparameters(np.zeros((1, 1)), np.zeros(1), np.array([-40.0]))
    model = DynamicsModel.train(x, y, warm_start=tiny, max_evaluations=1)
    assert model.notes == ()  # the search stays where it needs none
    model = DynamicsModel.condition(x, y, tiny)
    assert model.notes
    assert "output 0: the kernel matrix needed a jitter of" in model.notes[0]
    assert capsys.readouterr() == ("", "")


def test_refusals_say_what_was_expected():
    rng = np.random.default_rng(5)
    x, y = example_data(rng, 10, 2, 3)
    with pytest.raises(InvalidSettingError, match="row 4, column 1"):
        DynamicsModel.train(x, np.where(np.arange(20).reshape(10, 2) == 9, np.nan, y))
    with pytest.raises(InvalidSettingError, match=r"expected \(n, P\) and \(n, E\)"):
        DynamicsModel.train(x[:5], y)
    with pytest.raises(InvalidSettingError, match=r"expected \(2, 3\)"):
        DynamicsModel.train(x, y, prior_mean=np.zeros((2, 2)))
    with pytest.raises(InvalidSettingError, match=r"expected \(2, 3\) like the data"):
        DynamicsModel.train(x, y, warm_start=example_hyperparameters(rng, 2, 4))
    with pytest.raises(InvalidSettingError, match="beyond"):
        Hyperparameters(np.full((1, 1), 200.0), np.zeros(1), np.zeros(1))
    with pytest.raises(InvalidSettingError, match=r"log_noise has shape \(2,\); expected \(1,\)"):
        Hyperparameters(np.zeros((1, 1)), np.zeros(1), np.zeros(2))
