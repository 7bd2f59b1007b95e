"""What repeats at the same time of every trial, beside what depends on the state."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from test_command_history import lagging_trial, settings, task

from irlpilco_ros.learning import Rollout, apprenticeship
from irlpilco_ros.learning.gp.kernel import Hyperparameters, squared_exponential
from irlpilco_ros.learning.gp.linear_part import LinearPart
from irlpilco_ros.learning.gp.repeated_part import RepeatedPart
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.prediction.trial_data import what_repeats


def test_predictions_are_those_of_one_kernel_with_all_parts():
    rng = np.random.default_rng(0)
    inputs, targets = rng.standard_normal((12, 3)), rng.standard_normal((12, 2))
    steps, linear = np.arange(12) % 4, LinearPart(np.array([[1], [2]]), np.ones((2, 1)))
    given = Hyperparameters(
        0.2 * rng.standard_normal((2, 3)),
        np.array([0.1, -0.2]),
        np.array([-1.0, -1.5]),
        np.array([-0.3, 0.2]),
        np.array([-0.5, 0.3]),
    )
    model = DynamicsModel.condition(
        inputs, targets, given, linear=linear, repeated=RepeatedPart(steps, 4)
    )
    assert given.log_linear is not None
    assert given.log_repeated is not None
    at, certain = rng.standard_normal(3), np.zeros((3, 3))
    for a in range(2):
        lengths, signal = np.exp(given.log_lengthscales[a]), float(given.signal_variance[a])
        slope, repeated = np.exp(2.0 * given.log_linear[a]), np.exp(2.0 * given.log_repeated[a])
        z = inputs[:, a + 1]

        K = squared_exponential(inputs, inputs, lengths, signal) + slope * np.outer(z, z)
        K += repeated * (steps[:, None] == steps) + given.noise_variance[a] * np.eye(12)
        for step in (None, 2, 9):
            k = squared_exponential(at[None], inputs, lengths, signal)[0] + slope * at[a + 1] * z
            k += repeated * (steps == step)
            moments, _ = model.predict(at, certain, gradient=False, step=step)
            assert moments.mean[a] == pytest.approx(k @ np.linalg.solve(K, targets[:, a]))


def test_what_was_seen_often_is_less_uncertain():
    rng = np.random.default_rng(1)
    inputs, steps = rng.standard_normal((30, 2)), np.minimum(np.arange(30), 3)
    given = Hyperparameters(
        np.full((1, 2), 3.0), np.zeros(1), np.array([-2.0]), log_repeated=np.array([-1.0])
    )
    targets = (steps == 3)[:, None] + 0.1 * rng.standard_normal((30, 1))
    model = DynamicsModel.condition(inputs, targets, given, repeated=RepeatedPart(steps, 4))
    rare, often = (
        model.predict(np.zeros(2), np.zeros((2, 2)), gradient=False, step=step)[0]
        for step in (0, 3)
    )
    assert often.mean.item() - rare.mean.item() > 0.5
    assert 0.0 < often.covariance.item() < rare.covariance.item()


def test_what_repeats_at_one_speed_is_not_what_repeats_at_another():
    def trial(steps):
        return Rollout(np.zeros((steps + 1, 4)), np.zeros((steps, 2)))

    made = [trial(4), trial(6), trial(4)]
    part = what_repeats(made, [1.0, 0.7, 1.0], 1.0, 4)
    assert part.horizon == 10
    expected = [*range(4), *range(4, 10), *range(4)]
    np.testing.assert_array_equal(part.steps, expected)
    # Before the first trial at a speed nothing is known of its steps, and they come first.
    part = what_repeats(made, [1.0, 0.7, 1.0], 1.3, 3)
    assert part.horizon == 13
    np.testing.assert_array_equal(part.steps, np.add(expected, 3))


def trials(push):
    """Return what makes trials in which the first joint is pushed in the middle, every time."""
    seeds = itertools.count()

    def run(policy):
        trial = lagging_trial(policy, seed=next(seeds))
        states = trial.states.copy()
        states[len(states) // 2, 0] += push
        return Rollout(states, trial.controls)

    return run


def test_evidence_finds_what_repeats_and_finds_nothing_where_nothing_does():
    sizes = {}
    for name, push in (("pushed", 0.05), ("free", 0.0)):
        chosen = settings(repeating_errors=True, evaluations=2)
        loop = apprenticeship(task(), chosen, trials(push))
        iteration = [next(loop) for _ in range(4)][-1]
        found = iteration.hyperparameters
        assert found.log_repeated is not None
        sizes[name] = float(np.exp(found.log_repeated[0] - found.log_noise[0]))
    assert sizes["pushed"] > 3.0 * sizes["free"]


def test_an_iteration_is_written_and_read_with_what_repeats():
    chosen = settings(repeating_errors=True, evaluations=2)
    loop = apprenticeship(task(), chosen, lagging_trial)
    _, found = next(loop), next(loop)
    again = Iteration.from_arrays(found.to_arrays()).hyperparameters
    for field in dataclasses.fields(again):
        np.testing.assert_array_equal(
            getattr(again, field.name), getattr(found.hyperparameters, field.name)
        )
