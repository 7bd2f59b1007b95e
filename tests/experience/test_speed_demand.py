"""A demonstration that is faster than the robot may be is said to be."""

from __future__ import annotations

import dataclasses

import numpy as np
from robot_of_two import ROBOT

from irlpilco_ros.experience.speed_demand import too_slow
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task


def task(*speeds):
    """A demonstration whose wrist goes at these speeds [rad/s], one for each period of 0.1 s."""
    wrist = np.concatenate([[0.0], np.cumsum(speeds)]) * 0.1
    states = np.zeros((len(wrist), 4))
    states[:, 1] = wrist
    shown = Rollout(states, np.full((len(speeds), 2), np.nan))
    return Task((shown,), 0.1, ROBOT.control_limit)


def test_a_joint_that_was_shown_faster_than_it_may_is_named():
    (note,) = too_slow(task(1.0, -2.5, 0.5), ROBOT)
    assert "joint wrist was shown at 2.50 rad/s, and its velocity_limit is 2 rad/s" in note


def test_what_the_robot_can_do_is_no_word_worth():
    assert too_slow(task(1.0, -2.0, 2.01), ROBOT) == ()
    efforts = dataclasses.replace(ROBOT, command_interface="effort")
    assert too_slow(task(1.0, -2.5, 0.5), efforts) == ()
