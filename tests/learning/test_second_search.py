"""A search that comes out much worse than before: told, and done again from the best policy."""

import dataclasses
import functools

import numpy as np
import pytest
from toy_models import LaggingJoints, toy_task

from irlpilco_ros.learning import Iteration, LearningSettings, judge
from irlpilco_ros.learning.apprenticeship import LearningLoop
from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.learn import learn
from irlpilco_ros.learning.policies import LinearPolicy
from irlpilco_ros.learning.search.policy_search import SearchResult
from irlpilco_ros.learning.second_search import MUCH_WORSE, search_twice_if_needed
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy

TASK = toy_task()
SETTINGS = LearningSettings(threads=1, evaluations=8)


@functools.cache
def policy(number):
    return LinearPolicy(np.full((1, 2), float(number)), np.zeros(1), np.ones(1))


def iteration(index, cost):
    return Iteration(index, policy(index), cost=cost)


class Search:
    """Finds what it is told to, one after the other, and notes where it started."""

    def __init__(self, *costs):
        self.costs, self.starts = list(costs), []

    def __call__(self, starts):
        self.starts.append(list(starts))
        cost = self.costs.pop(0)
        if cost is None:
            raise NumericalError("nothing finite")
        return SearchResult(policy(cost), cost, 3)


STARTS = [policy(8), policy(9)]


def nothing(index):
    """What a trial did cost, if it was perfect."""
    return 0.0


@pytest.mark.parametrize(
    ("cost", "previous", "best"),
    [
        (0.9 * MUCH_WORSE, iteration(4, 1.0), iteration(2, 1.5)),
        (50.0, None, iteration(0, np.nan)),
        (50.0, iteration(4, np.nan), None),
        (-1.0, iteration(4, -100.0), iteration(4, -100.0)),  # no ratio says anything
        (0.0, iteration(4, 0.0), None),
    ],
)
def test_what_is_not_much_worse_is_taken_as_it_is(cost, previous, best):
    search = Search(cost)
    found, notes = search_twice_if_needed(search, STARTS, previous, best, nothing)
    assert (found.cost, found.evaluations, notes) == (cost, 3, ())
    assert search.starts == [STARTS]


@pytest.mark.parametrize("best", [iteration(2, 1.5), iteration(2, 0.5), iteration(2, np.nan)])
def test_what_is_much_worse_starts_again_from_the_best(best):
    search = Search(80.0, 2.0)
    found, (note,) = search_twice_if_needed(search, STARTS, iteration(4, 1.0), best, nothing)
    assert search.starts == [STARTS, [best.policy]]
    assert (found.cost, found.evaluations) == (2.0, 6)
    assert "predicted cost 80 was" in note
    assert "searched again from the policy of iteration 2: 2" in note
    assert "bad trial" not in note


def test_what_costs_next_to_nothing_is_well():
    """Feature expectations can be met to 1e-20; the next prediction of 1e-18 is no collapse."""
    search = Search(1e-18)
    found, notes = search_twice_if_needed(
        search, STARTS, iteration(4, 1e-20), iteration(2, 1e-12), {2: 1e-4}.get
    )
    assert (found.cost, notes) == (1e-18, ())


def test_without_a_better_one_it_starts_from_the_last():
    for best in (None, Iteration(0, open_loop_policy(TASK))):  # which cannot be searched
        search = Search(80.0, 2.0)
        search_twice_if_needed(search, STARTS, iteration(4, 1.0), best, nothing)
        assert search.starts[1] == [iteration(4, 1.0).policy]


def test_a_second_search_in_vain_says_what_to_expect():
    last = iteration(4, 1.0)
    found, (note,) = search_twice_if_needed(Search(80.0, 90.0), STARTS, last, last, nothing)
    assert (found.cost, found.evaluations) == (80.0, 6)
    assert "80 times the 1 of iteration 4" in note
    assert "expect a bad trial, and give the search more evaluations" in note
    found, (note,) = search_twice_if_needed(Search(80.0, None), STARTS, last, last, nothing)
    assert found.cost == 80.0
    assert note.endswith("iteration 4: nothing finite")


def test_after_a_collapse_the_measure_is_still_the_best():
    search = Search(70.0, 2.0)
    search_twice_if_needed(search, STARTS, iteration(5, 80.0), iteration(4, 1.0), nothing)
    assert search.starts[1] == [iteration(4, 1.0).policy]


def test_a_collapse_as_it_was_found_is_mended():
    """With four evaluations by L-BFGS 75 mrad became 1.6 rad, and 0.4 rad for ever after."""
    settings = LearningSettings(
        threads=1, evaluations=4, imitation="trajectory_kl", optimiser="lbfgs"
    )
    loop, robot = LearningLoop(TASK, settings), Robot()
    told = []
    for _ in range(4):
        told += loop.propose().notes
        loop.take(robot.run(loop.last.policy))
    errors = [judge(TASK, trial).rmse for trial in loop.trials]
    assert errors[1] > 10.0 * errors[0], "or it collapses no more"
    (note,) = told
    assert "searched again from the policy of iteration 0" in note
    assert errors[2] < errors[0]
    assert errors[3] < errors[2]


class Robot:
    def __init__(self):
        self.trials = 0

    def run(self, policy):
        self.trials += 1
        return LaggingJoints(self.trials).run(policy, TASK.reference_states()[0])


@pytest.fixture(scope="module")
def learned():
    loop, robot = LearningLoop(TASK, SETTINGS), Robot()
    for _ in range(4):
        loop.take(robot.run(loop.propose().policy))
    return loop


def test_the_loop_knows_its_best_trial(learned):
    errors = [judge(TASK, trial).mse for trial in learned.trials]
    assert learned.best.index == np.argmin(errors)
    np.testing.assert_array_equal(
        learned.best.trial.states, learned.trials[learned.best.index].states
    )


def test_a_search_that_cannot_get_far_ends_near_the_best_policy(learned):
    """One evaluation from a policy that does nothing: 10 mrad became 0.2 rad, without a word."""
    poor = dataclasses.replace(SETTINGS, evaluations=2, starts=("zero",))
    seen = []
    found = learn(TASK, poor, learned.trials, learned.last, seen.append, learned.best)
    (note,) = found.notes
    assert f"from the policy of iteration {learned.best.index}" in note
    assert found.cost < 2.0 * learned.best.cost
    fractions = [progress.fraction for progress in seen]
    assert fractions == sorted(fractions)
    trial = LaggingJoints(99).run(found.policy, TASK.reference_states()[0])
    assert judge(TASK, trial).rmse < 2.0 * judge(TASK, learned.best.trial).rmse
