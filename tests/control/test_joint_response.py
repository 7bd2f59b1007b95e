"""Gain and drift from looks, as sure as they are."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.control.joint_response import JointResponse
from irlpilco_ros.control.look import Look


def look(time, positions, speeds, speed_error=0.002):
    return Look(
        time,
        np.array(positions),
        np.array(speeds),
        np.full(2, 1e-4),
        np.full(2, speed_error),
    )


def test_a_gain_is_learned_from_a_long_way_and_hardly_from_a_short_one():
    response = JointResponse(2)
    nowhere = np.zeros(2)
    response.learn(look(0.0, (0.0, 0.0), (0.0, 0.0)), nowhere, 0.0)
    response.learn(look(3.0, (0.7, 0.0013), (0.0, 0.0)), np.array([1.0, 0.001]), 0.0)
    np.testing.assert_allclose(response.gain, [0.7, 1.0], atol=0.01)
    assert response.gain_deviation[0] < 0.02
    assert response.gain_deviation[1] == pytest.approx(0.15, abs=0.01)
    assert not response.holding.any()


def test_a_drift_is_held_once_it_is_certain():
    response = JointResponse(2)
    response.learn(look(0.0, (0.0, 0.0), (0.05, 0.004)), np.zeros(2), 0.0)
    np.testing.assert_allclose(response.holding, [-0.05, 0.0])
    # What is left of it counts from then on, and the joint that never drifted stays alone.
    response.learn(look(10.0, (0.03, 0.0), (0.003, 0.004)), np.zeros(2), 0.0)
    assert -0.054 < response.holding[0] < -0.0505
    assert response.holding[1] == 0.0


def test_what_a_short_way_leaves_unexplained_is_drift():
    response = JointResponse(2)
    response.learn(look(0.0, (0.0, 0.0), (0.0, 0.0)), np.zeros(2), 0.0)
    drift = response.learn(look(10.0, (0.02, 0.01), (0.0, 0.0)), np.array([0.0, 0.01]), 0.0)
    np.testing.assert_allclose(drift, [0.002, 0.0], atol=2e-4)
    np.testing.assert_allclose(response.holding, -drift, atol=1e-9)


def test_what_may_be_missing_of_a_way_is_no_certain_drift():
    response = JointResponse(2)
    response.learn(look(0.0, (0.0, 0.0), (0.0, 0.0)), np.zeros(2), 0.0)
    response.learn(look(1.0, (0.0, 0.0005), (0.0, 0.0)), np.array([0.0005, 0.0]), 0.001)
    assert not response.holding.any()
