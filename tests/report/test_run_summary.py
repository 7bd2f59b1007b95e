from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from report_runs import LATE, summary


def test_predicted_error_counts_mean_and_spread_but_not_the_start() -> None:
    run = summary(("a", "b"), horizon=2)
    iteration = run.iterations[1]
    mean, deviation = run.demonstration.copy(), np.zeros((3, 2))
    mean[0] += 5.0
    deviation[0] = 7.0
    mean[1, 0] += 0.3
    deviation[2, 1] = 0.4
    iteration = dataclasses.replace(iteration, prediction=mean, deviation=deviation)
    assert run.predicted_rmse(iteration) == pytest.approx(np.sqrt((0.3**2 + 0.4**2) / 4))


def test_initial_trial_has_no_predicted_error() -> None:
    run = summary(("a", "b"))
    assert np.isnan(run.predicted_rmse(run.iterations[0]))
    assert np.isnan(run.coverage(run.iterations[0]))


def test_coverage_counts_what_is_within_two_standard_deviations() -> None:
    run = summary(("a", "b"), horizon=2)
    trial = np.array([[9.0, 9.0], [0.19, 0.21], [-0.19, 0.0]])
    iteration = dataclasses.replace(
        run.last, trial=trial, prediction=np.zeros((3, 2)), deviation=np.full((3, 2), 0.1)
    )
    assert run.coverage(iteration) == pytest.approx(3 / 4)


def test_error_of_each_joint_leaves_out_the_start() -> None:
    run = summary(("a", "b"))
    trial = run.demonstration + np.array([LATE, 2 * LATE])
    trial[0] += 1.0
    errors = run.joint_rmse(dataclasses.replace(run.last, trial=trial))
    np.testing.assert_allclose(errors, [LATE, 2 * LATE])


def test_relevance_is_spread_by_lengthscale() -> None:
    model = summary(("a",)).model
    assert model is not None
    np.testing.assert_allclose(model.relevance[0], 2.0 / model.lengthscales[0])


def test_other_features_than_joints_are_numbered() -> None:
    run = summary(("a", "b"), iterations=1)
    assert run.feature_names == ("a", "b")
    assert dataclasses.replace(run, features=()).feature_names == ("feature 1", "feature 2")
    last = dataclasses.replace(run.last, weights=np.ones(3))
    other = dataclasses.replace(run, iterations=(run.iterations[0], last))
    assert other.feature_names == ("feature 1", "feature 2", "feature 3")


def test_full_turns_of_a_continuous_joint_are_no_error() -> None:
    run = dataclasses.replace(summary(("a", "b")), continuous=("b",))
    turned = np.array([0.0, 2.0 * np.pi])
    assert run.last.prediction is not None
    last = dataclasses.replace(
        run.last, trial=run.last.trial + turned, prediction=run.last.prediction - turned
    )
    np.testing.assert_allclose(run.joint_rmse(last), run.joint_rmse(run.last))
    assert run.predicted_rmse(last) == pytest.approx(run.predicted_rmse(run.last))
    assert run.coverage(last) == run.coverage(run.last)
    np.testing.assert_allclose(run.difference(last.trial), last.trial - run.demonstration - turned)
