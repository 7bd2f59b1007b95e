"""Steps of demonstrations as data: commands are told where they can be, and help where they are."""

import dataclasses

import numpy as np
import pytest
from driven_cart import LIMIT, STEPS, random_trials, shown, task_of

from irlpilco_ros.learning import LearningSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.inferred_steps import inferred_steps
from irlpilco_ros.learning.learn import learn
from irlpilco_ros.learning.prediction.trial_data import train_on_trials

SETTINGS = LearningSettings(
    prior_mean="zero",
    policy="rbf",
    options={"rbf.count": 5},
    optimiser="bfgs",
    initial_policy="zero",
    evaluations=3,
    threads=1,
)


def model_of(task, trials):
    return train_on_trials(trials, task.state_layout, None, None, 1)


def test_the_commands_of_all_steps_are_told_by_trials_that_know_them():
    task = task_of(shown().states)
    steps = inferred_steps(task, LIMIT, model_of(task, random_trials(6)))
    np.testing.assert_allclose(steps.inputs[:, -1:], shown().controls, atol=0.02)
    np.testing.assert_array_equal(steps.inputs[:, :-1], shown().states[:-1])
    np.testing.assert_array_equal(steps.targets, np.diff(shown().states, axis=0))


def test_steps_of_every_demonstration_count():
    task = task_of(shown().states)
    twice = dataclasses.replace(task, demonstrations=2 * task.demonstrations)
    steps = inferred_steps(twice, LIMIT, model_of(task, random_trials(6)))
    assert len(steps.inputs) == 2 * STEPS


def test_a_step_that_no_command_makes_is_left_out():
    states = shown().states.copy()
    states[6, 1] += 0.5  # the flag, which nobody commands
    task = task_of(states)
    steps = inferred_steps(task, LIMIT, model_of(task, random_trials(6)))
    without = np.delete(states[:-1], (5, 6), axis=0)
    np.testing.assert_array_equal(steps.inputs[:, :-1], without)


def test_what_the_robot_cannot_have_done_is_told():
    states = shown().states.copy()
    states[:, 1] += 0.5 * (-1.0) ** np.arange(STEPS + 1)
    task, trials = task_of(states), random_trials(6)
    settings = dataclasses.replace(SETTINGS, infer_commands=True)
    (note,) = learn(task, settings, trials).notes
    assert "for 0 of 12 steps of the demonstrations" in note
    assert not learn(task_of(shown().states), settings, trials).notes


def test_progress_goes_forward():
    told = []
    settings = dataclasses.replace(SETTINGS, infer_commands=True)
    learn(task_of(shown().states), settings, random_trials(2), progress=told.append)
    fractions = [each.fraction for each in told]
    assert fractions == sorted(fractions)
    assert {each.stage for each in told} == {"model", "policy"}


def test_learning_knows_the_demonstration_better():
    demonstrated = shown()
    task, trials = task_of(demonstrated.states), random_trials(1, seed=1, spread=0.0)
    usual = learn(task, SETTINGS, trials)
    found = learn(task, dataclasses.replace(SETTINGS, infer_commands=True), trials)
    again = learn(task, dataclasses.replace(SETTINGS, infer_commands=True), trials)
    np.testing.assert_array_equal(found.policy.parameters, again.policy.parameters)
    spread = [np.trace(each.predicted_covariances[-1]) for each in (usual, found)]
    assert spread[1] < 0.5 * spread[0]


@pytest.mark.parametrize("also", [{"command_history": 1}, {"repeating_errors": True}])
def test_what_a_demonstration_cannot_tell_is_refused(also):
    with pytest.raises(InvalidSettingError, match="set command_history: 0 and repeating_errors"):
        LearningSettings(infer_commands=True, **also)
