"""The model's inverse: controls found again, gains that stabilise."""

import numpy as np
import pytest
from driven_cart import LIMIT, A, B, random_trials, shown, task_of

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.prediction.trial_data import train_on_trials
from irlpilco_ros.learning.starts.initial_policy import zero_policy
from irlpilco_ros.learning.starts.inverse_policy import inverse_policy, regulator, slopes_along


@pytest.fixture(scope="module")
def problem():
    task = task_of(shown().states)
    model = train_on_trials(random_trials(6), task.state_layout, None, None, 1)
    return task, model, shown()


def test_the_controls_of_the_demonstration_are_found_again(problem):
    task, model, demonstrated = problem
    slopes = slopes_along(task, model, LIMIT)
    np.testing.assert_allclose(slopes.controls, demonstrated.controls, atol=0.02)
    np.testing.assert_allclose(slopes.by_state, np.broadcast_to(A, (12, 4, 4)), atol=0.02)
    np.testing.assert_allclose(slopes.by_control, np.broadcast_to(B, (12, 4, 1)), atol=0.02)


def test_controls_stay_within_the_limit(problem):
    task, model, _ = problem
    tight = slopes_along(task, model, np.array([0.5])).controls
    assert np.abs(tight).max() == pytest.approx(0.5)


def test_the_regulator_brings_the_robot_back(problem):
    task, model, demonstrated = problem
    slopes = slopes_along(task, model, LIMIT)
    gains = regulator(slopes, np.maximum(demonstrated.states.std(axis=0), 1e-3), LIMIT)
    off = np.array([0.05, 0.0, 0.0, 0.0])
    left_alone, brought_back = off, off
    for gain in gains:
        left_alone = A @ left_alone
        brought_back = A @ brought_back - B @ (gain @ brought_back)
    assert abs(brought_back[0]) < 0.3 * abs(left_alone[0])


@pytest.mark.parametrize("kind", ["rbf", "linear", "linear_phase"])
def test_the_policy_goes_the_demonstration_s_way(problem, kind):
    task, model, demonstrated = problem
    settings = LearningSettings(policy=kind, options={"rbf.count": 12}, prior_mean="zero")
    policy = inverse_policy(task, settings, model)
    assert policy.kind == kind
    np.testing.assert_array_equal(policy.control_limit, LIMIT)
    states = demonstrated.states[:-1]
    told = np.array([policy.act(state, t) for t, state in enumerate(states)])
    zero = zero_policy(task, settings)
    idle = np.array([zero.act(state, t) for t, state in enumerate(states)])
    error, nothing = (
        np.abs(told - demonstrated.controls).mean(),
        np.abs(idle - demonstrated.controls).mean(),
    )
    assert error < (0.9 if kind == "linear" else 0.35) * nothing
