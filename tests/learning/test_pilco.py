"""Classical PILCO on a small unstable system: it must learn to hold it."""

import dataclasses

import numpy as np
import pytest

from irlpilco_ros.learning.costs import StateCost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.pilco import (
    ControlTask,
    improve,
    pilco,
    random_controls,
    random_start,
    search_evaluations,
)
from irlpilco_ros.learning.prediction.state_layout import StateLayout
from irlpilco_ros.learning.rollout import Rollout

LAYOUT = StateLayout(2, angles=(0,), dynamics_inputs=(1, 2, 3), policy_inputs=(1, 2, 3))
SETTINGS = LearningSettings(
    policy="rbf", options={"rbf.count": 6}, optimiser="lbfgs", evaluations=25, threads=1
)


def pendulum_task(horizon=8):
    """Turn an overdamped arm from hanging to horizontal, state [angle, angular speed]."""
    target = np.array([np.pi / 2, 0.0])
    cost = StateCost(JointPositions(2), target, np.diag([4.0, 0.0]))
    start = Gaussian(np.zeros(2), 1e-4 * np.eye(2))
    return ControlTask(LAYOUT, start, horizon, np.array([2.0]), cost)


def run_trial(policy, horizon=8):
    rng = np.random.default_rng(0)
    state, states, controls = 0.01 * rng.standard_normal(2), [], []
    for t in range(horizon):
        control = policy.act(LAYOUT.policy_view(state), t)
        states.append(state)
        controls.append(control)
        for _ in range(10):
            speed = control[0] - np.sin(state[0])
            state = np.array([state[0] + 0.05 * speed, speed])
    return Rollout(np.array([*states, state]), np.array(controls))


def test_pilco_learns_to_reach_the_target():
    """PILCO's own search; the seeds 0 to 7 all came within 0.003 rad."""
    settings = dataclasses.replace(SETTINGS, optimiser="bfgs", evaluations=60)
    found = list(pilco(pendulum_task(), settings, run_trial, 4))
    reached = run_trial(found[-1].policy).states[-1, 0]
    assert abs(reached - np.pi / 2) < 0.02
    assert found[-1].cost < found[0].cost + 1.0
    assert [iteration.index for iteration in found] == [1, 2, 3, 4]
    assert found[-1].prediction.means.shape == (9, 2)


def test_all_evaluations_are_counted_and_told_of():
    task, told = pendulum_task(), []
    trials = [run_trial(random_controls(task, SETTINGS.seed))]
    found = improve(
        task, SETTINGS, trials, progress=lambda cost, evaluations: told.append(evaluations)
    )
    assert told == list(range(1, found.evaluations + 1))
    assert found.evaluations <= search_evaluations(SETTINGS) + 2  # one for each search's start


def test_first_trial_is_random_within_the_limit():
    task = pendulum_task()
    table = random_controls(task, 1).controls
    assert (np.abs(table) <= 2.0).all()
    assert table.std() > 0.5


def test_starting_policies():
    task = pendulum_task()
    assert random_start(task, SETTINGS).kind == "rbf"
    assert random_start(task, dataclasses.replace(SETTINGS, policy="linear")).kind == "linear"
    with pytest.raises(InvalidSettingError, match="rbf, linear"):
        random_start(task, dataclasses.replace(SETTINGS, policy="linear_phase"))
    with pytest.raises(InvalidSettingError, match="at least one trial"):
        improve(task, SETTINGS, [])
