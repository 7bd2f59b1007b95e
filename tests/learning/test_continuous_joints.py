"""Learning with a joint that turns without end, under velocity commands."""

import dataclasses
from itertools import islice

import numpy as np
import pytest
from toy_models import DT, JOINTS, LaggingJoints, toy_demonstration, toy_task

from irlpilco_ros.learning import LearningSettings, Rollout, apprenticeship
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.gp.prior_mean import velocity_prior
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.learn import learn, start_state
from irlpilco_ros.learning.prediction.trial_data import seen_prior
from irlpilco_ros.learning.state_layout import StateLayout

NAMES = tuple(f"joint{number}" for number in range(JOINTS))
TURNING = Joints(NAMES, continuous=NAMES[:1])
SETTINGS = LearningSettings(options={"linear_phase.count": 6}, threads=1)


def turned(by):
    """The toy task, its first joint turned so that the way leads through pi."""
    shown = toy_demonstration()
    states = shown.states.copy()
    states[:, 0] += by
    return dataclasses.replace(
        toy_task(),
        demonstrations=(Rollout(states, shown.controls),),
        features=JointPositions.of_robot(TURNING),
        layout=TURNING.layout,
    )


def test_a_joint_that_turns_is_learned_like_any_other():
    task = turned(np.pi - 0.1)
    robot, start = LaggingJoints(0), task.reference_states()[0]
    trials = [
        iteration.trial
        for iteration in islice(
            apprenticeship(task, SETTINGS, lambda it: robot.run(PolicyOf(TURNING, it), start)), 3
        )
    ]
    reference = task.reference_states()[:, :JOINTS]
    off = [np.sqrt(np.mean((trial.states[:, :JOINTS] - reference) ** 2)) for trial in trials]
    assert off[-1] < 0.4 * off[0]


@pytest.mark.parametrize("differences", [None, (1, 2, 3)])
def test_the_prior_mean_of_what_the_model_sees(differences):
    layout = StateLayout(4, angles=(0,), dynamics_inputs=(1, 2, 3, 4, 5), differences=differences)
    A = seen_prior(velocity_prior(2, 0.5), layout)
    assert A.shape == (4, 5 + 2)
    states, control = np.array([[0.3, -0.2, 0.5, 0.1]] * 2), np.array([1.0, 2.0])
    states[1] = [0.8, 0.8, 1.0, 2.0]  # what an ideal robot makes of the command
    predicted = A @ np.concatenate([layout.dynamics_view(states[0]), control])
    seen = slice(0 if differences is None else 1, None)  # an angle is not predicted from nothing
    np.testing.assert_allclose(predicted[seen], layout.targets(states)[0, seen])


def test_it_is_the_whole_prior_where_all_is_seen():
    whole = velocity_prior(JOINTS, DT)
    assert np.array_equal(seen_prior(whole, StateLayout(2 * JOINTS)), whole)


def test_trials_that_begin_on_either_side_of_pi_begin_at_one_place():
    task = turned(np.pi)
    starts = [
        task.reference_states(),
        task.reference_states() - 2.0 * np.pi * np.eye(2 * JOINTS)[0],
    ]
    trials = [Rollout(states, np.zeros((len(states) - 1, JOINTS))) for states in starts]
    np.testing.assert_allclose(start_state(task, trials).mean, starts[0][0])
    assert start_state(task, trials).covariance.max() < 1e-3


def test_a_velocity_prior_needs_a_command_of_every_joint():
    shown = toy_demonstration()
    task = dataclasses.replace(
        toy_task(),
        demonstrations=(Rollout(shown.states, shown.controls[:, :1]),),
        control_limit=np.ones(1),
    )
    trial = Rollout(shown.states, np.zeros((shown.steps, 1)))
    with pytest.raises(InvalidSettingError, match=f"1 of {JOINTS} joints are commanded"):
        learn(task, SETTINGS, [trial])
