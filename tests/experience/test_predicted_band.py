"""The predicted band as parameters beside the policy's own, in a request and in a file."""

from __future__ import annotations

import numpy as np
import pytest
import toy_robot
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.demonstrated import Demonstrated
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.experience.policy_file import (
    DEMONSTRATED,
    policy_from_parameters,
    policy_to_parameters,
    read_policy_file,
)
from irlpilco_ros.experience.predicted_band import DEVIATIONS, POSITIONS, PredictedBand
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.learning_settings import LearningSettings

JOINTS = Joints(("a", "b"))
BAND = PredictedBand(np.arange(6.0).reshape(3, 2), 0.1 * np.arange(6.0).reshape(3, 2))


@given(st.integers(1, 4), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_it_comes_back_from_parameters(joints, horizon, seed):
    rng = np.random.default_rng(seed)
    shape = (horizon + 1, joints)
    band = PredictedBand(rng.standard_normal(shape), np.abs(rng.standard_normal(shape)))
    names = Joints(tuple(f"joint{number}" for number in range(joints)))
    again = PredictedBand.from_parameters(band.to_parameters(), names)
    assert again.horizon == horizon
    np.testing.assert_allclose(again.positions, band.positions, atol=1e-7)
    np.testing.assert_allclose(again.deviations, band.deviations, atol=1e-7)


def test_where_nothing_was_predicted_there_is_none():
    assert PredictedBand.from_parameters({}, JOINTS) is None
    assert PredictedBand.from_parameters({POSITIONS: [], DEVIATIONS: []}, JOINTS) is None


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({DEVIATIONS: []}, "predicted_deviations has 0 values"),
        ({POSITIONS: []}, "predicted_positions has 0 values"),
        ({POSITIONS: [0.0] * 5, DEVIATIONS: [0.0] * 5}, "has 5 values; expected one for each of 2"),
        ({POSITIONS: [0.0] * 2, DEVIATIONS: [0.0] * 2}, "has 2 values"),
        ({POSITIONS: [np.nan] * 6}, "predicted_positions holds a number that is not finite"),
        ({DEVIATIONS: [np.inf] * 6}, "predicted_deviations holds a number that is not finite"),
        ({DEVIATIONS: [-0.1] * 6}, "below 0"),
    ],
)
def test_what_is_no_band_is_refused(change, reason):
    with pytest.raises(InvalidSettingError, match=reason):
        PredictedBand.from_parameters({**BAND.to_parameters(), **change}, JOINTS)


@pytest.mark.parametrize(
    ("values", "reason"),
    [([0.0] * 5, "has 5 values; expected one for each of 2"), ([np.nan] * 4, "is not finite")],
)
def test_what_was_never_shown_is_refused(values, reason):
    assert Demonstrated.from_parameters({DEMONSTRATED: []}, JOINTS) is None
    with pytest.raises(InvalidSettingError, match=reason):
        Demonstrated.from_parameters({DEMONSTRATED: values}, JOINTS)


def test_a_plan_and_its_policy_file_hold_it_from_the_first_prediction_on(tmp_path):
    bag = toy_robot.record_demonstration(tmp_path / "shown")
    settings = LearningSettings(evaluations=3)
    run = Apprenticeship.open(tmp_path / "run", bag, toy_robot.ROBOT, settings)
    first = run.prepare()
    shown = Demonstrated.from_parameters(first.parameters, toy_robot.ROBOT.roles)
    expected = run.task.reference_states()[:, : len(toy_robot.JOINTS)]
    np.testing.assert_allclose(shown.positions, expected, atol=1e-7)
    assert PredictedBand.from_parameters(first.parameters, toy_robot.ROBOT.roles) is None
    run.finish(toy_robot.record_trial(first, run.directory.trials_directory))
    plan = run.prepare()
    run.close()
    band = PredictedBand.from_parameters(plan.parameters, toy_robot.ROBOT.roles)
    expected = plan.iteration.predicted_means[:, : len(toy_robot.JOINTS)]
    np.testing.assert_allclose(band.positions, expected, atol=1e-7)
    assert (band.deviations[1:] > 0.0).all()
    path = run.directory.policy_file(1)
    written = PredictedBand.from_parameters(
        load_parameters_file(path, "controller"), toy_robot.ROBOT.roles
    )
    np.testing.assert_array_equal(written.positions, band.positions)
    np.testing.assert_array_equal(written.deviations, band.deviations)
    again = Demonstrated.from_parameters(
        load_parameters_file(path, "controller"), toy_robot.ROBOT.roles
    )
    np.testing.assert_array_equal(again.positions, shown.positions)
    policy, joints = read_policy_file(path)
    np.testing.assert_array_equal(policy.parameters, plan.iteration.policy.parameters)
    beside = {**policy_to_parameters(policy, joints), **band.to_parameters()}
    assert policy_from_parameters(beside)[1] == joints
