"""The loop: its order, taking a run up at any point, waiting for trials, and where it ends."""

import dataclasses
from itertools import islice

import numpy as np
import pytest
from toy_models import LaggingJoints, toy_demonstration, toy_task

from irlpilco_ros.learning import (
    Iteration,
    LearningLoop,
    LearningSettings,
    apprenticeship,
    judge,
    pilco,
)
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.starts.initial_policy import initial_policy

TASK = toy_task()
SETTINGS = LearningSettings(threads=1, evaluations=4)


class Robot:
    """Counts trials; the noise of a trial depends on its number only."""

    def __init__(self, done=0):
        self.trials = done

    def run(self, policy):
        self.trials += 1
        return LaggingJoints(self.trials).run(policy, TASK.reference_states()[0])


@pytest.fixture(scope="module")
def whole():
    return list(islice(apprenticeship(TASK, SETTINGS, Robot().run), 4))


def same(one, other):
    assert one.index == other.index
    np.testing.assert_array_equal(one.policy.parameters, other.policy.parameters)
    np.testing.assert_array_equal(one.trial.states, other.trial.states)


def test_it_begins_with_the_initial_policy_and_learns_from_every_trial(whole):
    assert [iteration.index for iteration in whole] == [0, 1, 2, 3]
    first = initial_policy(TASK, SETTINGS)
    np.testing.assert_array_equal(whole[0].policy.parameters, first.parameters)
    errors = [judge(TASK, iteration.trial).rmse for iteration in whole]
    assert errors[3] < errors[0] / 10
    assert whole[0].hyperparameters.log_signal.size == 0
    assert np.isnan(whole[0].cost)


@pytest.mark.parametrize("done", [1, 2, 3])
def test_a_run_that_is_taken_up_goes_on_as_if_it_had_not_stopped(whole, done):
    trials = [iteration.trial for iteration in whole[:done]]
    loop = apprenticeship(TASK, SETTINGS, Robot(done).run, trials, whole[done - 1])
    for expected in whole[done:4]:
        same(next(loop), expected)


def test_what_was_learned_and_not_tried_is_tried_first(whole):
    untried = dataclasses.replace(whole[2], tried=None)
    trials = [iteration.trial for iteration in whole[:2]]

    def never(_):
        raise AssertionError("it learned again")

    loop = apprenticeship(TASK, SETTINGS, Robot(2).run, trials, untried, never)
    same(next(loop), whole[2])


def test_who_waits_for_a_trial_gets_the_same(whole):
    loop, robot = LearningLoop(TASK, SETTINGS), Robot()
    for expected in whole[:3]:
        proposed = loop.propose()
        assert loop.propose() is proposed
        with pytest.raises(InvalidSettingError, match="was not tried yet"):
            _ = proposed.trial
        same(loop.take(robot.run(proposed.policy)), expected)
    with pytest.raises(InvalidSettingError, match=r"trial 3 belongs to no iteration; .*propose"):
        loop.take(expected.trial)


def test_cancelling_leaves_the_loop_where_it_stood(whole):
    loop = LearningLoop(TASK, SETTINGS, [whole[0].trial], whole[0])

    def cancel(progress):
        if progress.stage == "policy":
            raise TimeoutError

    with pytest.raises(TimeoutError):
        loop.propose(cancel)
    assert loop.last is whole[0]
    same(loop.take(whole[1].trial) if loop.propose() else None, whole[1])


def test_it_ends_when_the_margin_is_small_enough(whole):
    assert whole[2].margin < whole[1].margin
    settings = dataclasses.replace(SETTINGS, margin_tolerance=whole[2].margin)
    ended = list(islice(apprenticeship(TASK, settings, Robot().run), 4))
    assert [iteration.learned for iteration in ended] == [False, False, True]
    same(ended[-1], whole[2])
    trials = [iteration.trial for iteration in ended]
    with pytest.raises(StopIteration):
        next(apprenticeship(TASK, settings, Robot(3).run, trials, ended[-1]))


def test_what_does_not_go_together_is_refused_at_once(whole):
    with pytest.raises(InvalidSettingError, match="learned from 2 trials, but 1 were given"):
        apprenticeship(TASK, SETTINGS, Robot().run, [whole[0].trial], whole[2])
    with pytest.raises(InvalidSettingError, match="the task has no cost"):
        pilco(TASK, SETTINGS, Robot().run)
    loop = apprenticeship(TASK, SETTINGS, lambda _: toy_demonstration())
    next(loop)
    with pytest.raises(InvalidSettingError, match="trial 0 has no controls"):
        next(loop)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("predicted_means", np.zeros(3)),
        ("predicted_covariances", np.zeros((7, 4))),
        ("predicted_covariances", np.zeros((7, 4, 3))),
        ("weights", np.asarray(["a", "b"])),
        ("weights", np.asarray([1.0, np.nan])),
        ("weights", np.zeros(2, complex)),
        ("log_signal", np.zeros(3)),
        ("log_lengthscales", np.asarray(1.0)),
        ("index", np.asarray(-1)),
    ],
)
def test_an_iteration_whose_arrays_do_not_fit_is_refused_by_name(whole, name, value):
    with pytest.raises(InvalidSettingError, match=f"an iteration's {name}"):
        Iteration.from_arrays({**whole[1].to_arrays(), name: value})


@pytest.mark.parametrize("index", [0, 1])
def test_an_iteration_is_kept_without_its_trial(whole, index):
    kept = Iteration.from_arrays(whole[index].to_arrays())
    assert kept.tried is None
    for name, value in whole[index].to_arrays().items():
        np.testing.assert_array_equal(kept.to_arrays()[name], value)
