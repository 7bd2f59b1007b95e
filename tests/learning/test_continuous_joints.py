"""Learning with a joint that turns without end, under velocity commands."""

import dataclasses
from itertools import islice

import numpy as np
from toy_models import JOINTS, LaggingJoints, toy_demonstration, toy_task

from irlpilco_ros.learning import LearningSettings, Rollout, apprenticeship
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.learn import start_state

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


def test_trials_that_begin_on_either_side_of_pi_begin_at_one_place():
    task = turned(np.pi)
    starts = [
        task.reference_states(),
        task.reference_states() - 2.0 * np.pi * np.eye(2 * JOINTS)[0],
    ]
    trials = [Rollout(states, np.zeros((len(states) - 1, JOINTS))) for states in starts]
    np.testing.assert_allclose(start_state(task, trials).mean, starts[0][0])
    assert start_state(task, trials).covariance.max() < 1e-3
