"""Bands of what will be measured: they learn from how the trial before lay in its own."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from test_command_history import DT, shown

from irlpilco_ros.learning import Iteration, Rollout, Task
from irlpilco_ros.learning.measured_band import measured_deviations
from irlpilco_ros.learning.policies import LinearPolicy
from irlpilco_ros.learning.state_layout import StateLayout

TASK = Task((shown(),), DT, np.array([2.0, 2.0]), position_noise=3e-3, velocity_noise=1e-2)
STEPS, D = shown().states.shape
SPREAD = np.tile(np.diag([16e-6, 16e-6, 1e-4, 1e-4]), (STEPS, 1, 1))


def iteration(index, covariances=SPREAD):
    policy = LinearPolicy(np.zeros((2, D)), np.zeros(2), np.ones(2))
    return Iteration(
        index, policy, predicted_means=shown().states, predicted_covariances=covariances
    )


def trial(off, seed=0):
    """Return what was predicted, and noise so many times as large as it should be."""
    noise = np.random.default_rng(seed).standard_normal((STEPS, D))
    noise *= off * np.sqrt(np.diagonal(SPREAD[0]) + TASK.noise**2)
    return Rollout(shown().states + noise, np.zeros((STEPS - 1, 2)))


def test_without_a_trial_that_tells_it_is_the_predicted_spread_and_the_sensors_noise():
    expected = np.tile([5e-3, 5e-3, np.sqrt(2e-4), np.sqrt(2e-4)], (STEPS, 1))
    np.testing.assert_allclose(measured_deviations(TASK, SPREAD, None, []), expected)
    found = measured_deviations(TASK, SPREAD, iteration(1), [trial(9.0)] * 2)
    np.testing.assert_allclose(found, 1.1 * expected)


@pytest.mark.parametrize("off", [0.3, 1.0, 4.0])
def test_it_is_as_wide_as_the_trial_before_was_off(off):
    held = []
    for seed in range(50):
        found = measured_deviations(TASK, SPREAD, iteration(6), [trial(off, seed)] * 7)
        after = np.abs(trial(off, seed=1000 + seed).states - shown().states)
        held.append((after < 2.0 * found)[1:, :2].mean())
    assert 0.85 < np.mean(held) < 0.96


def test_after_fewer_trials_more_of_what_it_was_off_is_expected_to_be_learned():
    early, late = (
        measured_deviations(TASK, SPREAD, iteration(index), [trial(1.0)] * 7) for index in (2, 6)
    )
    assert (early < 0.95 * late).all()


def test_a_joint_that_turns_without_end_is_no_turn_off():
    layout = StateLayout(D, angles=(1,))
    turning = Task((shown(),), DT, np.array([2.0, 2.0]), layout=layout)
    turned = trial(1.0).states + 2.0 * np.pi * np.eye(D)[1]
    plain, found = (
        measured_deviations(
            turning, SPREAD, iteration(2), [Rollout(states, np.zeros((STEPS - 1, 2)))] * 3
        )
        for states in (trial(1.0).states, turned)
    )
    np.testing.assert_allclose(found, plain)


def test_what_corrected_an_iteration_that_was_not_tried_corrects_the_next():
    trials = [trial(4.0)] * 3
    corrected = measured_deviations(TASK, SPREAD, iteration(2), trials)
    untried = dataclasses.replace(iteration(3), predicted_deviations=corrected)
    np.testing.assert_allclose(measured_deviations(TASK, SPREAD, untried, trials), corrected)


def test_a_trial_without_any_error_leaves_a_band():
    exactly = Rollout(shown().states, np.zeros((STEPS - 1, 2)))
    assert (measured_deviations(TASK, SPREAD, iteration(2), [exactly] * 3) > 4e-4).all()


def test_an_iteration_without_them_has_the_predicted_spread_and_files_keep_them():
    found = iteration(2)
    np.testing.assert_allclose(found.predicted_deviations[:, 0], 4e-3)
    arrays = found.to_arrays()
    np.testing.assert_array_equal(
        Iteration.from_arrays(arrays).predicted_deviations, found.predicted_deviations
    )
    del arrays["predicted_deviations"]
    np.testing.assert_allclose(Iteration.from_arrays(arrays).predicted_deviations[:, 0], 4e-3)
