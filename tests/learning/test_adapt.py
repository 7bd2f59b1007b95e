"""The same motion elsewhere: what carries over, and what is learned there from all trials."""

from __future__ import annotations

import dataclasses
from itertools import islice
from typing import Any

import numpy as np
import pytest
from toy_models import DT, HORIZON, JOINTS, LaggingJoints, toy_demonstration, toy_task

from irlpilco_ros.learning import (
    Iteration,
    LearningLoop,
    LearningSettings,
    Rollout,
    Task,
    apprenticeship,
    judge,
)
from irlpilco_ros.learning.adapt import EVALUATIONS, adapt, carried_policy
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.learn import start_state, weigh
from irlpilco_ros.learning.measured_band import measured_deviations
from irlpilco_ros.learning.policies import REGISTRY
from irlpilco_ros.learning.starts.initial_policy import initial_policy, open_loop_policy

SETTINGS = LearningSettings(
    prior_mean="identified",
    policy="smooth_phase",
    command_history=1,
    repeating_errors=True,
    options={"smooth_phase.count": 7, "feature_matching.variance_weight": 0.3},
    sensor_noise=True,
    threads=1,
)
HERE = toy_task()


def elsewhere(offset=(0.5, -0.3), size=1.3) -> Task:
    """Return the demonstration begun elsewhere, and somewhat larger."""
    shown = toy_demonstration()
    states = size * shown.states + np.repeat([offset, (0.0, 0.0)], 2)[[0, 2, 4, 6]]
    states[:, :JOINTS] = size * shown.states[:, :JOINTS] + offset
    return dataclasses.replace(HERE, demonstrations=(Rollout(states, shown.controls),))


class Robot:
    """Makes trials of tasks; the noise depends on the number of the trial alone."""

    def __init__(self, done: int = 0) -> None:
        self.trials = done

    def run(self, policy, task: Task = HERE) -> Rollout:
        self.trials += 1
        robot, start = LaggingJoints(self.trials), task.reference_states()[0]
        return robot.run(Remembering(policy), start, task.horizon)  # type: ignore[arg-type]


class Remembering:
    """Shows a policy the last command, as the controller does."""

    def __init__(self, policy) -> None:
        self._policy, self._last = policy, np.zeros(JOINTS)

    def act(self, state, step):
        if len(state) < self._policy.state_size:
            state = np.concatenate([state, self._last])
        self._last = self._policy.act(state, step)
        return self._last


@pytest.fixture(scope="module")
def practised() -> tuple[list[Rollout], Iteration]:
    loop = apprenticeship(HERE, SETTINGS, Robot().run)
    found = list(islice(loop, 3))
    return [each.trial for each in found], found[-1]


def test_at_once_it_is_better_than_what_is_not_learned(practised):
    trials, last = practised
    task = elsewhere()
    adapted = adapt(task, SETTINGS, trials, [HERE] * 3, last)
    assert adapted.index == 3
    assert adapted.evaluations <= EVALUATIONS + 1
    off = judge(task, Robot(10).run(adapted.policy, task)).rmse
    assert off < 0.3 * judge(task, Robot(10).run(open_loop_policy(task), task)).rmse
    assert off < 0.3 * judge(task, Robot(10).run(last.policy, task)).rmse
    predicted = adapted.predicted_means[:, :JOINTS] - task.reference_states()[:, :JOINTS]
    assert np.sqrt(np.mean(predicted**2)) < 0.02
    # It starts where it was shown to start, at rest, and knows it as well as the sensors do.
    np.testing.assert_array_equal(adapted.predicted_means[0, JOINTS:], 0.0)
    np.testing.assert_array_equal(
        adapted.predicted_means[0, :JOINTS], task.reference_states()[0, :JOINTS]
    )
    np.testing.assert_allclose(np.diag(adapted.predicted_covariances[0]), task.noise**2)


def test_the_band_is_corrected_by_how_the_last_trial_lay_in_its_own(practised):
    trials, last = practised
    found = adapt(elsewhere(), SETTINGS, trials, [HERE] * 3, last)
    variances = np.diagonal(found.predicted_covariances, axis1=1, axis2=2)
    plain = np.sqrt(np.maximum(variances, 0.0) + HERE.noise**2)
    corrected = measured_deviations(HERE, found.predicted_covariances, last, trials)
    np.testing.assert_allclose(found.predicted_deviations, corrected)
    assert np.abs(corrected / plain - 1.0).min() > 0.02


def test_wider_starts_are_for_the_search_alone(practised):
    trials, last = practised
    usual, prepared = (
        adapt(
            elsewhere(), dataclasses.replace(SETTINGS, start_widening=w), trials, [HERE] * 3, last
        )
        for w in (1.0, 5.0)
    )
    start = usual.predicted_covariances[0]
    np.testing.assert_array_equal(prepared.predicted_covariances[0], start)
    assert not np.array_equal(prepared.policy.parameters, usual.policy.parameters)


def test_threads_change_nothing(practised):
    trials, last = practised
    one, two = (
        adapt(elsewhere(), dataclasses.replace(SETTINGS, threads=n), trials, [HERE] * 3, last)
        for n in (1, 2)
    )
    np.testing.assert_array_equal(one.policy.parameters, two.policy.parameters)


def test_the_feed_forward_is_that_of_the_nearest_trial_that_was_best(practised):
    trials, last = practised
    near, far = elsewhere((0.1, 0.0), 1.0), elsewhere((1.0, 1.0), 1.0)
    bad = dataclasses.replace(trials[0], controls=trials[0].controls + 0.1)
    tasks = [HERE, far, HERE]
    chosen = carried_policy(near, SETTINGS, [trials[0], bad, trials[2]], tasks, last.policy)
    alone = carried_policy(near, SETTINGS, [trials[2]], [HERE], last.policy)
    assert judge(HERE, trials[2]).mse < judge(HERE, trials[0]).mse
    np.testing.assert_array_equal(chosen.parameters, alone.parameters)
    # Along what is shown here it commands what was commanded there; the motion is the same.
    layout = near.remembering(1).state_layout
    states = layout.whole_states(near.reference_states(), trials[2].controls)
    commanded = [chosen.act(state, step) for step, state in enumerate(states[:-1])]
    np.testing.assert_allclose(commanded, trials[2].controls, atol=0.02)


@pytest.mark.parametrize("kind", ["linear_phase", "smooth_phase"])
def test_a_policy_keeps_its_gains_along_other_states(kind):
    rng, H = np.random.default_rng(0), 12
    task = toy_task()
    limit, other = np.array([1.0, 2.0]), np.array([1.5, 1.0])
    cls = REGISTRY.get(kind)
    zero: Any = cls.zero(task, limit, cls.Settings(count=6))
    policy: Any = dataclasses.replace(zero, weights=0.2 * rng.standard_normal((2, 4)), horizon=H)
    states = np.cumsum(0.05 * rng.standard_normal((H, 4)), axis=0)
    wanted = 0.1 * np.sin(np.arange(H) / 4.0)[:, None] * [1.0, -1.0]
    moved = policy.along(states, wanted, other)
    assert moved.control_limit.tolist() == other.tolist()
    # The slope of a control near zero is 3/2 of limit times gain.
    np.testing.assert_allclose(
        moved.weights * other[:, None], policy.weights * limit[:, None], atol=1e-12
    )


def test_a_kind_of_policy_without_gains_is_searched_as_usual(practised):
    trials, last = practised
    settings = dataclasses.replace(SETTINGS, policy="rbf", options={"rbf.count": 5}, evaluations=3)
    rbf = dataclasses.replace(last, policy=initial_policy(HERE.remembering(1), settings))
    assert carried_policy(elsewhere(), settings, trials, [HERE] * 3, rbf.policy) is None
    adapted = adapt(elsewhere(), settings, trials, [HERE] * 3, rbf)
    assert adapted.policy.kind == "rbf"


def test_before_any_trial_it_is_the_initial_policy():
    first = adapt(elsewhere(), SETTINGS, [], [], None)
    assert first.index == 0
    expected = initial_policy(elsewhere(), SETTINGS)
    np.testing.assert_array_equal(first.policy.parameters, expected.parameters)


def test_after_one_trial_that_nothing_was_learned_from_it_learns(practised):
    trials, _ = practised
    first = Iteration(0, initial_policy(HERE, SETTINGS))
    adapted = adapt(elsewhere(), SETTINGS, trials[:1], [HERE], first)
    assert adapted.index == 1
    assert np.isfinite(adapted.cost)


def test_a_loop_that_moves_goes_on_there_with_all_trials(practised):
    trials, last = practised
    task, robot, told = elsewhere(), Robot(10), []
    loop = LearningLoop(HERE, SETTINGS, trials, last)
    moved = loop.move(task, told.append)
    assert loop.propose() is moved
    assert told[-1].fraction == 1.0
    errors = []
    for _ in range(2):
        iteration = loop.take(robot.run(loop.propose().policy, task))
        errors.append(judge(task, iteration.trial).rmse)
    assert [each is task for each in loop.tasks] == [False] * 3 + [True] * 2
    assert errors[1] < max(errors[0], 0.01)
    assert loop.best.index in (3, 4)
    # Where it began it is better than ever, too, and what was learned elsewhere counts.
    back = loop.move(HERE)
    assert back.index == 5
    off = judge(HERE, robot.run(back.policy)).rmse
    assert off < 2.0 * judge(HERE, trials[-1]).rmse + 1e-3
    assert loop.best is None
    # Moved once more before a trial: what was not tried is dropped.
    again = loop.move(task)
    assert (again.index, len(loop.trials)) == (5, 5)


def test_trials_are_weighed_by_what_they_were_trials_of(practised):
    trials, _ = practised
    shifted = [Rollout(each.states + np.r_[0.5, -0.3, 0.0, 0.0], each.controls) for each in trials]
    there = elsewhere((0.5, -0.3), 1.0)
    expected = weigh(HERE, SETTINGS, trials)
    for tasks, given in (
        ([there] * 3, shifted),
        ([HERE, there, HERE], [trials[0], shifted[1], trials[2]]),
    ):
        weights, margin = weigh(HERE, SETTINGS, given, tasks)
        np.testing.assert_allclose(weights, expected[0], atol=1e-9)
        assert margin == pytest.approx(expected[1])


def test_a_start_is_where_trials_of_the_place_began(practised):
    trials, _ = practised
    measured = start_state(HERE, trials)
    np.testing.assert_allclose(measured.mean, np.mean([t.states[0] for t in trials], axis=0))
    spread = dataclasses.replace(HERE, start_spread=0.1)
    np.testing.assert_allclose(np.diag(start_state(spread, []).covariance), 0.01)


def test_a_task_of_another_size_is_refused(practised):
    trials, last = practised
    states = np.zeros((HORIZON + 1, 6))
    wider = Task((Rollout(states, np.full((HORIZON, 3), np.nan)),), DT, np.full(3, 2.0))
    with pytest.raises(InvalidSettingError, match="trial 0 has states"):
        adapt(wider, SETTINGS, trials, [HERE] * 3, last)
    with pytest.raises(InvalidSettingError, match="trial 0 has states"):
        adapt(at_speed(0.75), SETTINGS, trials, [at_speed(0.75)] * 3, last)


def at_speed(speed: float) -> Task:
    """Return the demonstration at another speed: the same positions at other times."""
    t = np.arange(HORIZON / speed + 1.0) * speed / HORIZON
    positions = np.stack([0.4 * np.sin(np.pi * t), 0.3 - 0.3 * np.cos(2 * np.pi * t)], axis=1)
    states = np.hstack([positions, np.gradient(positions, DT, axis=0)])
    states[0, JOINTS:] = 0.0
    nobody = np.full((len(t) - 1, JOINTS), np.nan)
    return Task((Rollout(states, nobody),), DT, HERE.control_limit, speed=speed)


@pytest.mark.parametrize("speed", [0.75, 1.5])
def test_at_another_speed_it_is_good_at_once_and_better_after_a_trial(practised, speed):
    trials, last = practised
    task, robot = at_speed(speed), Robot(20)
    assert task.horizon != HORIZON
    loop = LearningLoop(HERE, SETTINGS, trials, last)
    moved = loop.move(task)
    assert moved.predicted_means.shape == (task.horizon + 1, 2 * JOINTS)
    assert moved.policy.to_arrays()["horizon"] == task.horizon
    errors = []
    for _ in range(3):
        iteration = loop.take(robot.run(loop.propose().policy, task))
        errors.append(judge(task, iteration.trial).rmse)
    replayed = judge(task, Robot(20).run(open_loop_policy(task), task)).rmse
    assert errors[0] < 0.35 * replayed
    assert errors[2] < max(0.6 * errors[0], 0.01)
    # All trials are in one model, and back at the shown speed it knows what it knew.
    back = loop.move(HERE)
    assert (back.index, len(loop.trials)) == (6, 6)
    off = judge(HERE, robot.run(back.policy)).rmse
    assert off < 2.0 * judge(HERE, trials[-1]).rmse + 2e-3


def test_what_was_commanded_beside_what_was_shown_scales_with_the_speed(practised):
    trials, last = practised
    task = at_speed(1.5)
    gain = 1.3
    driven = dataclasses.replace(trials[0], controls=gain * HERE.demonstrated_controls())
    policy = carried_policy(task, SETTINGS, [driven], [HERE], last.policy)
    layout = task.remembering(1).state_layout
    wanted = gain * task.demonstrated_controls()
    states = layout.whole_states(task.reference_states(), wanted)
    commanded = [policy.act(state, step) for step, state in enumerate(states[:-1])]
    np.testing.assert_allclose(np.sum(commanded, axis=0), wanted.sum(axis=0), atol=0.1)
    np.testing.assert_allclose(commanded, wanted, atol=0.3)


def test_trials_at_another_speed_are_weighed_at_the_same_moments(practised):
    trials, _ = practised
    task = at_speed(1.5)
    there = Rollout(
        np.stack([np.interp(1.5 * np.arange(5), np.arange(7), c) for c in trials[0].states.T], 1),
        trials[0].controls[:4],
    )
    alone, _ = weigh(HERE, SETTINGS, trials[:1])
    found, _ = weigh(HERE, SETTINGS, [there], [task])
    np.testing.assert_allclose(found, alone, atol=0.2)
    both, _ = weigh(task, SETTINGS, [trials[0], there], [HERE, task])
    assert both.shape == (HERE.feature_map.size,)
