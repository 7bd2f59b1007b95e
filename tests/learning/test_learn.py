import dataclasses
from itertools import islice

import numpy as np
import pytest
from toy_models import DT, HORIZON, JOINTS, LaggingJoints, toy_demonstration, toy_task

from irlpilco_ros.learning import Iteration, LearningSettings, Rollout, apprenticeship, judge
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import CubatureFeatures
from irlpilco_ros.learning.learn import learn, weigh
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy

SETTINGS = LearningSettings(options={"linear_phase.count": 6}, threads=1)


def run(settings, iterations, task=None, seed=0):
    task = task or toy_task()
    robot, start = LaggingJoints(seed), task.reference_states()[0]
    loop = apprenticeship(task, settings, lambda policy: robot.run(policy, start))
    found = list(islice(loop, iterations + 1))
    return task, [iteration.trial for iteration in found], found[1:]


def test_learning_beats_replay_within_three_iterations():
    task, trials, found = run(SETTINGS, 3)
    replay = LaggingJoints(9).run(open_loop_policy(task), task.reference_states()[0])
    errors = [judge(task, trial).rmse for trial in trials]
    assert errors[-1] < 0.5 * judge(task, replay).rmse
    assert errors[-1] < 0.02
    assert [iteration.index for iteration in found] == [1, 2, 3]
    margins = [iteration.margin for iteration in found]
    assert (np.diff(margins) <= 1e-9).all()
    predicted = found[-1].predicted_means[:, :JOINTS]
    assert np.abs(predicted - trials[-1].states[:, :JOINTS]).max() < 0.1


def test_wider_starts_are_for_the_search_alone():
    task, trials, _ = run(SETTINGS, 0)
    usual = learn(task, SETTINGS, trials)
    prepared = learn(task, dataclasses.replace(SETTINGS, start_widening=5.0), trials)
    start = usual.predicted_covariances[0]
    np.testing.assert_array_equal(prepared.predicted_covariances[0], start)
    assert not np.array_equal(prepared.policy.parameters, usual.policy.parameters)


@pytest.mark.parametrize(
    "changes",
    [
        {"imitation": "feature_expectations"},
        {"imitation": "trajectory_kl"},
        {
            "policy": "linear",
            "prior_mean": "zero",
            "options": {"feature_matching.variance_weight": 0.0},
            "optimiser": "lbfgs",
        },
        {"policy": "rbf", "options": {"rbf.count": 5}, "optimiser": "lbfgs"},
        {"covariance_approximation": "exact", "starts": ("last", "zero", "initial", "random")},
        {"weight_rule": "projection", "discount": 0.9, "initial_policy": "random"},
        {"weight_rule": "latest", "initial_policy": "zero", "weight_floor": 0.0},
    ],
)
def test_every_choice_runs_and_improves_its_cost(changes):
    settings = dataclasses.replace(SETTINGS, evaluations=8, **changes)
    costs = []
    task, trials, _ = run(settings, 0)
    iteration = learn(task, settings, trials, progress=lambda p: costs.append(p.cost))
    finite = [cost for cost in costs if np.isfinite(cost)]
    assert iteration.cost == finite[-1] < 0.5 * finite[1]  # what the better of two starts costs
    assert iteration.policy.kind == settings.policy
    assert np.isfinite(iteration.policy.parameters).all()
    assert np.isfinite(iteration.predicted_covariances).all()


def test_several_demonstrations_are_averaged_and_their_spread_counts():
    shown = [toy_demonstration(seed) for seed in range(3)]
    scaled = (0.8, 1.0, 1.2)
    runs = tuple(
        Rollout(factor * run.states, run.controls)
        for factor, run in zip(scaled, shown, strict=True)
    )
    task = dataclasses.replace(toy_task(), demonstrations=runs, position_noise=0.01)
    mean = np.mean([run.states[:, :JOINTS] for run in runs], axis=0)
    np.testing.assert_allclose(task.reference_features(), mean)
    spread = np.var([run.states[3, 0] for run in runs], ddof=1) + 0.01**2
    assert task.reference_covariances()[3, 0, 0] == pytest.approx(spread, rel=0.02)
    settings = dataclasses.replace(
        SETTINGS, imitation="trajectory_kl", optimiser="lbfgs", evaluations=16
    )
    _, trials, _ = run(settings, 3, task)
    assert judge(task, trials[-1]).rmse < 0.06


def test_the_divergence_ends_near_the_demonstration_not_in_a_wide_prediction():
    """From the first policy alone it ended hundreds of the noise's spreads away."""
    task, trials, found = run(dataclasses.replace(SETTINGS, imitation="trajectory_kl"), 2)
    assert judge(task, trials[-1]).rmse < 0.5 * judge(task, trials[0]).rmse
    deviations = np.sqrt(np.diagonal(found[-1].predicted_covariances, axis1=1, axis2=2))
    assert deviations[:, :JOINTS].max() < 0.02


def test_learning_is_deterministic_whatever_the_threads():
    task, trials, _ = run(SETTINGS, 1)
    one = learn(task, SETTINGS, trials)
    two = learn(task, dataclasses.replace(SETTINGS, threads=2), trials)
    for name, value in one.to_arrays().items():
        if not name.endswith("seconds"):
            np.testing.assert_array_equal(value, two.to_arrays()[name], err_msg=name)


@pytest.mark.parametrize("method", ["feature_matching", "trajectory_kl"])
def test_progress_goes_from_model_to_policy_and_may_cancel(method):
    settings = dataclasses.replace(SETTINGS, imitation=method)
    task, trials, _ = run(settings, 0)
    seen = []
    learn(task, settings, trials, progress=seen.append)
    assert [seen[0].stage, seen[-1].stage] == ["model", "policy"]
    fractions = [progress.fraction for progress in seen]
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] <= fractions[-1] <= 1.0
    assert seen[-1].message

    def cancel(progress):
        if progress.stage == "policy":
            raise TimeoutError

    with pytest.raises(TimeoutError):
        learn(task, settings, trials, progress=cancel)


def test_iteration_round_trip_through_a_file(tmp_path):
    _, _, (iteration,) = run(dataclasses.replace(SETTINGS, evaluations=2), 1)
    iteration = dataclasses.replace(iteration, notes=("a note", "another"))
    path = tmp_path / "001.npz"
    np.savez(path, **iteration.to_arrays())
    with np.load(path, allow_pickle=False) as stored:
        again = Iteration.from_arrays(stored)
        broken = {name: stored[name] for name in stored if name != "margin"}
    assert again.notes == ("a note", "another")
    assert again.margin == iteration.margin
    assert again.hyperparameters.log_signal.shape == (2 * JOINTS,)
    np.testing.assert_array_equal(again.policy.parameters, iteration.policy.parameters)
    with pytest.raises(InvalidSettingError, match="margin"):
        Iteration.from_arrays(broken)


def test_judge_is_the_mean_square_over_features_and_steps():
    task = toy_task()
    shown = task.demonstrations[0]
    moved = Rollout(shown.states + 0.1, np.zeros((HORIZON, JOINTS)))
    errors = judge(task, moved)
    assert errors.mse == pytest.approx(0.01)
    assert errors.rmse == pytest.approx(0.1)
    short = Rollout(shown.states[:-1], np.zeros((HORIZON - 1, JOINTS)))
    with pytest.raises(InvalidSettingError, match="shape"):
        judge(task, short)


def test_open_loop_is_the_demonstrated_speed_within_the_limit():
    task = dataclasses.replace(toy_task(), control_limit=np.full(JOINTS, 0.2))
    speeds = np.diff(task.reference_states()[:, :JOINTS], axis=0) / DT
    np.testing.assert_allclose(open_loop_policy(task).controls, np.clip(speeds, -0.2, 0.2))


def identity(points):
    return points, np.tile(np.eye(JOINTS), (len(points), 1, 1))


def test_weights_are_scaled_and_floored():
    features = CubatureFeatures(JOINTS, identity, ("rad", "m"))
    task = dataclasses.replace(toy_task(), features=features, feature_scale={"m": 1000.0})
    shown = task.demonstrations[0]
    trial = Rollout(shown.states + 0.1, np.zeros((HORIZON, JOINTS)))
    weights, margin = weigh(task, dataclasses.replace(SETTINGS, weight_floor=0.0), [trial])
    assert weights[1] < 1e-5
    assert margin == pytest.approx(HORIZON * 0.01, rel=1e-6)
    floored, same = weigh(task, dataclasses.replace(SETTINGS, weight_floor=0.5), [trial])
    assert same == margin
    assert floored[1] / floored[0] == pytest.approx(0.5)
    assert np.linalg.norm(floored) == pytest.approx(1.0)


def test_beyond_the_spread_weights_leave_out_what_demonstrations_differ_in():
    """Only by as much as the first joint was off can this trial be told from what was shown."""
    shown = toy_demonstration(0)
    aside = np.zeros(2 * JOINTS)
    aside[1] = 0.2
    runs = tuple(Rollout(shown.states + off * aside, shown.controls) for off in (-1.0, 0.0, 1.0))
    task = dataclasses.replace(toy_task(), demonstrations=runs)
    trial = Rollout(shown.states + 0.1, np.zeros((HORIZON, JOINTS)))
    bare = dataclasses.replace(SETTINGS, weight_floor=0.0)
    alike, _ = weigh(task, bare, [trial])
    np.testing.assert_allclose(alike, np.full(JOINTS, JOINTS**-0.5))
    spread = dataclasses.replace(bare, weight_rule="max_margin_spread")
    weights, margin = weigh(task, spread, [trial])
    others = np.arange(JOINTS) != 1
    np.testing.assert_allclose(weights, others / np.sqrt(others.sum()))
    assert margin == pytest.approx(HORIZON * 0.01 * np.sqrt(others.sum()))
    single = dataclasses.replace(task, demonstrations=runs[:1])
    told, expected = weigh(single, spread, [trial]), weigh(single, bare, [trial])
    np.testing.assert_allclose(told[0], expected[0])
    assert told[1] == pytest.approx(expected[1])


def test_trials_that_do_not_fit_are_refused():
    task, trials, _ = run(SETTINGS, 0)
    with pytest.raises(InvalidSettingError, match="at least one trial"):
        learn(task, SETTINGS, [])
    with pytest.raises(InvalidSettingError, match="trial 1 has no controls"):
        learn(task, SETTINGS, [*trials, toy_demonstration()])
    short = Rollout(trials[0].states[:-1], trials[0].controls[:-1])
    with pytest.raises(InvalidSettingError, match="trial 0"):
        learn(task, SETTINGS, [short])
