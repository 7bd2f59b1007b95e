"""Classical PILCO on a small unstable system: it must learn to hold it."""

import dataclasses
from itertools import islice

import numpy as np
import pytest

from irlpilco_ros.learning import LearningSettings, Rollout, Task, apprenticeship, pilco
from irlpilco_ros.learning.costs import StateCost
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.learn import learn
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.policies import OpenLoopPolicy
from irlpilco_ros.learning.starts.initial_policy import initial_policy
from irlpilco_ros.learning.starts.random_start import random_start
from irlpilco_ros.learning.state_layout import StateLayout

LAYOUT = StateLayout(2, angles=(0,), dynamics_inputs=(1, 2, 3), policy_inputs=(1, 2, 3))
SETTINGS = LearningSettings(
    prior_mean="zero",
    hyperprior="pilco",
    policy="rbf",
    options={"rbf.count": 6},
    initial_policy="random_controls",
    optimiser="lbfgs",
    evaluations=25,
    threads=1,
)


def pendulum_task(horizon=8):
    """Turn an overdamped arm from hanging to horizontal, state [angle, angular speed]."""
    target = np.array([np.pi / 2, 0.0])
    cost = StateCost(JointPositions(2), target, np.diag([4.0, 0.0]))
    start = Gaussian(np.zeros(2), 1e-4 * np.eye(2))
    limit = np.array([2.0])
    return Task((), 0.5, limit, layout=LAYOUT, cost=cost, start=start, horizon=horizon)


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
    """PILCO's own search; the seeds 0 to 5 all came within 0.0001 rad."""
    settings = dataclasses.replace(SETTINGS, optimiser="bfgs", evaluations=40)
    found = list(islice(pilco(pendulum_task(), settings, run_trial), 4))
    assert abs(found[-1].trial.states[-1, 0] - np.pi / 2) < 0.02
    assert found[-1].cost < found[1].cost + 1.0
    assert [iteration.index for iteration in found] == [0, 1, 2, 3]
    assert found[-1].predicted_means.shape == (9, 2)
    assert np.isnan(found[-1].margin)
    assert not found[-1].learned


def test_all_evaluations_are_counted_and_told_of():
    task, told = pendulum_task(), []
    trials = [run_trial(initial_policy(task, SETTINGS))]
    found = learn(task, SETTINGS, trials, progress=told.append)
    counts = [progress.evaluations for progress in told if progress.stage == "policy"]
    assert counts == list(range(1, found.evaluations + 1))
    assert found.evaluations <= 25 + 12 + 2  # half as many first; one for each search's start
    assert told[-1].fraction > 0.9


def test_first_trial_is_random_within_the_limit():
    first = initial_policy(pendulum_task(), dataclasses.replace(SETTINGS, seed=1))
    assert isinstance(first, OpenLoopPolicy)
    table = first.controls
    assert (np.abs(table) <= 2.0).all()
    assert table.std() > 0.5


def test_starting_policies():
    task = pendulum_task()
    assert random_start(task, SETTINGS, task.start).kind == "rbf"
    assert (
        random_start(task, dataclasses.replace(SETTINGS, policy="linear"), task.start).kind
        == "linear"
    )


@pytest.mark.parametrize("changes", [{"layout": None}, {"horizon": 0}])
def test_a_cost_alone_does_not_tell_the_size_of_the_problem(changes):
    with pytest.raises(InvalidSettingError, match="needs a layout and a horizon"):
        dataclasses.replace(pendulum_task(), **changes)


def test_without_a_demonstration_there_is_nothing_to_imitate():
    with pytest.raises(InvalidSettingError, match="no demonstration to imitate"):
        apprenticeship(pendulum_task(), SETTINGS, run_trial)
    fitted = dataclasses.replace(SETTINGS, initial_policy="demonstration")
    with pytest.raises(InvalidSettingError, match="choose initial_policy: random_controls"):
        next(pilco(pendulum_task(), fitted, run_trial))
