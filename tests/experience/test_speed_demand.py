"""A policy that is slower than its demonstration needs is said to be."""

from __future__ import annotations

import dataclasses

import numpy as np
from robot_of_two import ROBOT

from irlpilco_ros.experience.speed_demand import too_slow
from irlpilco_ros.learning.policies.open_loop import OpenLoopPolicy
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task


def task(*speeds):
    """A demonstration whose wrist goes at these speeds [rad/s], one for each period of 0.1 s."""
    wrist = np.concatenate([[0.0], np.cumsum(speeds)]) * 0.1
    states = np.zeros((len(wrist), 4))
    states[:, 1] = wrist
    shown = Rollout(states, np.full((len(speeds), 2), np.nan))
    return Task((shown,), 0.1, ROBOT.control_limit)


def policy(*limit):
    return OpenLoopPolicy(np.zeros((4, 2)), np.array(limit), 4)


def test_joints_that_were_shown_faster_than_they_may_go_are_named():
    shown = task(1.0, -2.5, 0.5)
    note = too_slow(shown, policy(1.0, 2.0), ROBOT)
    assert "slower than its demonstration needs: wrist at 2.50 rad/s, where it may go 2;" in note
    assert "wrist at 2.50 rad/s, where it may go 2.4;" in too_slow(shown, policy(1.0, 2.4), ROBOT)


def test_what_the_policy_can_do_is_not_worth_a_word():
    assert too_slow(task(1.0, -2.0, 2.01), policy(1.0, 2.0), ROBOT) == ""
    efforts = dataclasses.replace(ROBOT, command_interface="effort")
    assert too_slow(task(1.0, -2.5, 0.5), policy(1.0, 2.0), efforts) == ""
