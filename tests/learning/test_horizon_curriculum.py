"""Growing horizons: how far a policy follows, who wins, and where a search stops."""

import dataclasses

import numpy as np
import pytest
from toy_models import LaggingJoints, toy_model, toy_task

from irlpilco_ros.learning.costs import FeatureMatching
from irlpilco_ros.learning.errors import NumericalError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.learn import learn
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.policies import LinearPhasePolicy
from irlpilco_ros.learning.prediction.objective import Objective
from irlpilco_ros.learning.search.horizon_curriculum import HorizonCurriculum
from irlpilco_ros.learning.starts.initial_policy import initial_policy
from irlpilco_ros.learning.state_layout import StateLayout

HORIZON = 12


@pytest.fixture(scope="module")
def problem():
    steps = np.arange(HORIZON + 1.0)
    reference = np.stack([0.3 * np.sin(0.5 * steps), 0.3 * np.sin(0.9 * steps)], axis=1)
    cost = FeatureMatching(JointPositions(2), reference, np.array([0.6, 0.8]))
    start = Gaussian(np.zeros(4), 1e-4 * np.eye(4))
    return Objective(toy_model(6, 4, points=30), start, HORIZON, StateLayout(4), cost)


@pytest.fixture(scope="module")
def nothing():
    zero = np.zeros((2, HORIZON))
    return LinearPhasePolicy(np.zeros((2, 4)), zero, HORIZON, np.array([1.0, 0.8]))


@pytest.fixture(scope="module")
def curriculum(problem):
    return HorizonCurriculum(
        problem, problem.cost, "bfgs", stages=4, screening_evaluations=6, evaluations=12
    )


def test_horizons_grow_to_the_whole_and_tiny_ones_are_left_out(curriculum):
    assert curriculum.horizons == (6, 9, 12)
    assert dataclasses.replace(curriculum, stages=1).horizons == (12,)


def test_the_followed_horizon_ends_where_the_prediction_diverges(curriculum, nothing):
    followed = easy(curriculum, nothing)
    assert followed.followed_horizon(nothing) == HORIZON
    for step, stage in ((2, 6), (6, 6), (7, 9), (11, HORIZON)):
        reference = followed.cost.reference.copy()
        reference[step] += 10.0
        assert with_reference(followed, reference).followed_horizon(nothing) == stage


def test_where_nothing_can_be_predicted_the_prediction_has_diverged(curriculum, nothing):
    class Blind:
        def predict(self, *_, **__):
            raise NumericalError("not finite")

    blind = dataclasses.replace(curriculum.objective, model=Blind())
    assert dataclasses.replace(curriculum, objective=blind).followed_horizon(nothing) == 6


def test_finding_back_to_the_demonstration_gains_nothing(problem, curriculum, nothing):
    evaluation = problem.evaluate(nothing)
    trajectory = evaluation.trajectory
    steps = problem.cost.steps(trajectory.means, trajectory.covariances)
    assert steps.sum() == pytest.approx(evaluation.value, rel=1e-12)
    assert steps[0] == 0.0
    expected = sum(max(steps[: t + 1]) for t in range(HORIZON + 1))
    assert curriculum.cost_without_recovery(nothing, HORIZON) == pytest.approx(expected, rel=1e-12)
    assert expected > evaluation.value + 1.0  # it does come nearer at times


def test_what_diverges_early_is_searched_there_only(curriculum, nothing):
    hopeless, seen = with_reference(curriculum, curriculum.cost.reference + 5.0), []
    found = hopeless.search([nothing, nothing], lambda _, n: seen.append(n))
    assert seen == list(range(1, len(seen) + 1))
    assert (
        found.evaluations == len(seen) <= 3 * 7 + 13
    )  # one stage, two candidates, and on from there
    begun = hopeless.until(6)
    assert begun.evaluate(found.policy).value < begun.evaluate(nothing).value
    assert found.cost == pytest.approx(hopeless.objective.evaluate(found.policy).value, rel=1e-12)


def test_what_is_followed_is_searched_to_the_end_and_the_best_start_wins(curriculum, nothing):
    followed = easy(curriculum, nothing)
    other = nothing.with_parameters(0.5 * np.random.default_rng(0).standard_normal(32))
    assert followed.cost_without_recovery(other, HORIZON) > followed.cost_without_recovery(
        nothing, HORIZON
    )
    still = dataclasses.replace(followed, screening_evaluations=0, evaluations=0)
    for starts in ([nothing, other], [other, nothing]):
        assert still.search(starts).cost == followed.objective.evaluate(nothing).value
    assert followed.search([nothing]).cost < 0.9 * followed.objective.evaluate(nothing).value


def easy(curriculum, policy):
    """Return the task of doing what a policy does, of steps that may all be far off."""
    trajectory = curriculum.objective.evaluate(policy).trajectory
    reference = trajectory.means[:, :2] + 0.05
    reference[0] += 10.0  # the first step costs nothing, but counts where features are large
    return with_reference(curriculum, reference)


def with_reference(curriculum, reference):
    cost = dataclasses.replace(curriculum.cost, reference=reference)
    objective = dataclasses.replace(curriculum.objective, cost=cost)
    return dataclasses.replace(curriculum, cost=cost, objective=objective)


@pytest.mark.parametrize("method", ["feature_matching", "feature_expectations"])
def test_learning_in_stages_improves_and_tells_how_far_it_is(method):
    task = toy_task()
    settings = LearningSettings(
        imitation=method,
        options={"linear_phase.count": 6},
        threads=1,
        horizon_stages=3,
        starts=("inverse", "last"),
        screening_evaluations=4,
    )
    first, seen = initial_policy(task, settings), []
    trials = [LaggingJoints().run(first, task.reference_states()[0])]
    found = learn(task, settings, trials, progress=seen.append)
    plain = learn(task, dataclasses.replace(settings, horizon_stages=1), trials)
    fractions = [progress.fraction for progress in seen]
    assert (np.diff(fractions) >= 0.0).all()
    assert fractions[-1] <= 1.0
    assert found.cost < 1.2 * plain.cost
    same = np.array_equal(found.policy.parameters, plain.policy.parameters)
    assert same == (method == "feature_expectations")
