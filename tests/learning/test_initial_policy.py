import dataclasses

import numpy as np
import pytest
from toy_models import JOINTS, toy_task

from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.starts.initial_policy import initial_policy, policy_limit


@pytest.mark.parametrize(
    ("kind", "tolerance"), [("linear_phase", 0.01), ("linear", 0.15), ("rbf", 0.25)]
)
def test_the_demonstration_is_fitted(kind, tolerance):
    task = toy_task()
    policy = initial_policy(
        task, LearningSettings(policy=kind, options={"linear_phase.count": 6, "rbf.count": 6})
    )
    states, wanted = task.reference_states(), task.demonstrated_controls()
    controls = np.stack([policy.act(states[t], t) for t in range(task.horizon)])
    assert policy.kind == kind
    assert np.sqrt(np.mean((controls - wanted) ** 2)) < tolerance * np.abs(wanted).max()


@pytest.mark.parametrize("kind", ["linear_phase", "linear", "rbf"])
def test_zero_stands_still_and_random_is_the_thesis(kind):
    task = toy_task()
    settings = LearningSettings(policy=kind, initial_policy="zero")
    state = np.ones(2 * JOINTS)
    np.testing.assert_allclose(initial_policy(task, settings).act(state, 0), 0.0, atol=1e-12)
    settings = dataclasses.replace(settings, initial_policy="random", seed=3)
    first, again = initial_policy(task, settings), initial_policy(task, settings)
    np.testing.assert_array_equal(first.parameters, again.parameters)
    expected = np.random.default_rng(3).standard_normal(first.parameters.shape)
    np.testing.assert_array_equal(first.parameters, expected)
    small = initial_policy(task, dataclasses.replace(settings, initial_scale=0.01))
    np.testing.assert_allclose(small.parameters, 0.01 * expected, rtol=1e-12)
    other = initial_policy(task, dataclasses.replace(settings, seed=4))
    assert (other.parameters != first.parameters).any()


def test_limit_follows_the_demonstration_within_floor_and_robot():
    task = dataclasses.replace(toy_task(), control_limit=np.array([0.25, 2.0]))
    fastest = np.abs(task.demonstrated_controls()).max(axis=0)
    limit = policy_limit(task, LearningSettings(velocity_limit_factor=1.5))
    np.testing.assert_allclose(limit, [0.25, 1.5 * fastest[1]])
    slow = LearningSettings(velocity_limit_factor=1.0, velocity_limit_floor=1.9)
    np.testing.assert_allclose(policy_limit(task, slow), [0.25, 1.9])
