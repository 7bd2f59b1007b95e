import dataclasses
from typing import Any

import numpy as np
import pytest
from toy_models import JOINTS, LaggingJoints, toy_model, toy_task

from irlpilco_ros.learning.costs import FeatureMatching
from irlpilco_ros.learning.errors import InvalidSettingError, NumericalError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.learn import expected_cost, weigh
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.policies import LinearPhasePolicy, LinearPolicy
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.prediction.trial_data import train_on_trials
from irlpilco_ros.learning.search.optimisers import OPTIMISERS
from irlpilco_ros.learning.search.policy_search import search_policy
from irlpilco_ros.learning.settings import declarations
from irlpilco_ros.learning.starts.initial_policy import initial_policy, random_controls
from irlpilco_ros.learning.state_layout import StateLayout

LIMIT = np.array([1.0, 0.8])


def objective():
    reference = 0.3 * np.random.default_rng(1).standard_normal((6, 2)).cumsum(axis=0) * 0.3
    cost = FeatureMatching(JointPositions(2), reference, np.array([0.6, 0.8]))
    start = Gaussian(np.zeros(4), 1e-4 * np.eye(4))
    return Objective(toy_model(6, 4, points=30), start, 5, StateLayout(4), cost)


def policy(seed=None):
    zero = LinearPhasePolicy(np.zeros((2, 4)), np.zeros((2, 5)), 5, LIMIT)
    if seed is None:
        return zero
    noise = np.random.default_rng(seed).standard_normal(zero.parameters.shape)
    return zero.with_parameters(noise)


@pytest.mark.parametrize("optimiser", list(OPTIMISERS))
def test_search_improves_and_never_gets_worse(optimiser):
    problem, seen = objective(), []
    start = problem.evaluate(policy()).value
    found = search_policy(problem, [policy()], optimiser, 30, lambda c, n: seen.append((c, n)))
    assert found.cost < 0.5 * start
    assert found.cost == pytest.approx(problem.evaluate(found.policy).value, rel=1e-12)
    assert (np.diff([cost for cost, _ in seen]) <= 0.0).all()
    assert [n for _, n in seen] == list(range(1, len(seen) + 1))
    assert found.evaluations == len(seen) <= 31


def test_gauss_newton_needs_fewer_evaluations_to_imitate():
    task, settings = toy_task(), LearningSettings(options={"linear_phase.count": 6}, threads=1)
    first = initial_policy(task, settings)
    trials = [LaggingJoints().run(first, task.reference_states()[0])]
    prior = velocity_prior(JOINTS, task.dt)
    model = train_on_trials(trials, task.state_layout, prior, None, 1)
    weights, _ = weigh(task, settings, trials)
    problem = expected_cost(task, settings, model, trials, weights)
    gauss_newton = search_policy(problem, [first], "gauss_newton", 10)
    lbfgs = search_policy(problem, [first], "lbfgs", 20)
    assert gauss_newton.cost < 0.5 * lbfgs.cost


def test_scaled_parameters_find_gains_of_joints_that_stand_far_from_zero():
    """There a gain is a second bias; what it does about the joint's own motion is hard to see."""
    shown = toy_task().demonstrations[0]
    far = dataclasses.replace(shown, states=shown.states + np.repeat([5.0, 0.0], JOINTS))
    task, settings = dataclasses.replace(toy_task(), demonstrations=(far,)), LearningSettings()
    zero = LinearPolicy(np.zeros((JOINTS, 4)), np.zeros(JOINTS), LIMIT)
    trials = [LaggingJoints().run(random_controls(task, settings), far.states[0])]
    prior = velocity_prior(JOINTS, task.dt)
    model = train_on_trials(trials, task.state_layout, prior, None, 1)
    problem = expected_cost(task, settings, model, trials, np.array([0.6, 0.8]))
    scaled, plain = (
        search_policy(problem, [zero], name, 40).cost for name in ("scaled_lbfgs", "lbfgs")
    )
    assert scaled < 0.5 * plain


def test_policies_are_prepared_for_starts_that_are_farther_apart():
    problem = objective()
    wide = problem.with_wider_start(20.0)
    np.testing.assert_allclose(wide.start.covariance, 400.0 * problem.start.covariance)
    usual, prepared = (
        search_policy(each, [policy()], "gauss_newton", 20).policy for each in (problem, wide)
    )
    assert wide.evaluate(prepared).value < 0.9 * wide.evaluate(usual).value
    assert problem.evaluate(usual).value <= problem.evaluate(prepared).value


def test_the_best_start_is_improved():
    problem = objective()
    starts = [policy(0), policy(), policy(1)]
    best = min(problem.evaluate(start).value for start in starts)
    assert search_policy(problem, starts, "gauss_newton", 3).cost < 0.9 * best


class Saturated:
    """An objective with a start that costs least and leads nowhere, and one that leads far."""

    def __init__(self, problem, trap):
        self.problem, self.trap = problem, trap

    def evaluate(self, policy, gradient=True):
        evaluation = self.problem.evaluate(policy, gradient)
        if np.array_equal(policy.parameters, self.trap.parameters):
            return dataclasses.replace(
                evaluation, cost=dataclasses.replace(evaluation.cost, value=self.lowest)
            )
        return evaluation

    @property
    def lowest(self):
        return 0.95 * self.problem.evaluate(policy()).value


def test_a_start_that_leads_nowhere_does_not_end_the_search():
    trap = policy(0)
    problem: Any = Saturated(objective(), trap)
    found = search_policy(problem, [trap, policy()], "gauss_newton", 20, screening=4)
    assert found.cost < 0.7 * problem.lowest
    assert found.evaluations <= 2 + 20 + 4


def test_converged_search_stops_early():
    problem = objective()
    found = search_policy(problem, [policy()], "gauss_newton", 300)
    assert found.evaluations < 290
    again = search_policy(problem, [found.policy], "gauss_newton", 50)
    assert again.cost == pytest.approx(found.cost, rel=5e-2)


def test_curvature_is_positive_and_close_to_the_hessian_at_a_good_fit():
    """What Gauss-Newton leaves out vanishes with the deviations: they are zero here."""
    problem = objective()
    good = policy().with_parameters(0.3 * policy(2).parameters)
    reference = problem.evaluate(good).trajectory.means[:, :2]
    cost = dataclasses.replace(problem.cost, reference=reference, variance_weight=0.0)
    problem = dataclasses.replace(problem, cost=cost)
    curvature = problem.evaluate(good).curvature()

    def gradient(change):
        return problem.evaluate(good.with_parameters(good.parameters + change)).gradient()

    step = 1e-5
    axes = np.eye(len(good.parameters))
    slopes = [gradient(step * axis) - gradient(-step * axis) for axis in axes]
    hessian = np.stack(slopes) / (2.0 * step)
    assert np.linalg.eigvalsh(curvature).min() > -1e-8 * np.trace(curvature)
    assert np.linalg.norm(curvature - hessian) < 0.1 * np.linalg.norm(hessian)


def test_progress_may_cancel():
    def cancel(cost, evaluations):
        if evaluations == 3:
            raise KeyboardInterrupt

    for optimiser in ("gauss_newton", "bfgs", "lbfgs"):
        with pytest.raises(KeyboardInterrupt):
            search_policy(objective(), [policy()], optimiser, 30, cancel)


class Sometimes:
    """A model that fails at some of its predictions, counted from 0."""

    def __init__(self, model, failing):
        self.model, self.failing, self.count = model, failing, -1

    def predict(self, mean, covariance, approximation="first_order", gradient=True, step=None):
        self.count += 1
        if self.count in self.failing:
            raise NumericalError("no answer")
        return self.model.predict(mean, covariance, approximation, gradient)


@pytest.mark.parametrize("optimiser", list(OPTIMISERS))
def test_failed_predictions_are_passed_over(optimiser):
    problem = objective()
    model = Sometimes(problem.model, failing=[22])
    found = search_policy(dataclasses.replace(problem, model=model), [policy()], optimiser, 12)
    assert found.cost < 0.9 * problem.evaluate(policy()).value
    assert found.cost == pytest.approx(problem.evaluate(found.policy).value, rel=1e-12)
    assert found.evaluations == 13


class Walled:
    """An objective that has no finite value further than a distance from a policy."""

    def __init__(self, problem, centre, distance):
        self.problem, self.centre, self.distance = problem, centre, distance

    def evaluate(self, policy, gradient=True):
        if np.linalg.norm(policy.parameters - self.centre.parameters) > self.distance:
            raise NumericalError("no answer")
        return self.problem.evaluate(policy, gradient)


@pytest.mark.parametrize("optimiser", ["bfgs", "lbfgs"])
@pytest.mark.parametrize("distance", [3.0, 0.3])
def test_a_line_search_steps_back_from_where_nothing_can_be_predicted(optimiser, distance):
    """The best policy is 6.4 away; it is looked for as far as the wall."""
    problem: Any = Walled(objective(), policy(), distance)
    found = search_policy(problem, [policy()], optimiser, 30)
    assert found.evaluations > 25
    assert np.linalg.norm(found.policy.parameters) > 0.98 * distance


def test_no_finite_start_is_an_error_that_says_what_to_do():
    problem = objective()
    broken = dataclasses.replace(problem, model=Sometimes(problem.model, failing=range(1)))
    with pytest.raises(NumericalError, match="zero"):
        search_policy(broken, [policy()], "gauss_newton", 5)


def test_screening_improves_every_start_before_the_best_goes_on():
    problem = objective()
    starts = [policy(), policy(3)]
    found = search_policy(problem, starts, "bfgs", 22, screening=8)
    assert found.evaluations <= 32
    costs = [search_policy(problem, [start], "bfgs", 7).cost for start in starts]
    assert found.cost < 0.95 * min(costs), "it goes on where the better of them got"
    best = min(starts, key=lambda start: problem.evaluate(start).value)
    plain = search_policy(problem, starts, "bfgs", 0)
    assert plain.cost == pytest.approx(problem.evaluate(best).value, rel=1e-12)


def test_the_settings_offer_the_optimisers_there_are():
    assert declarations(LearningSettings)["optimiser"].choices == tuple(OPTIMISERS)
    with pytest.raises(InvalidSettingError, match="gauss_newton, bfgs, lbfgs, scaled_lbfgs"):
        search_policy(objective(), [policy()], "newton", 5)
