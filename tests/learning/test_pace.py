"""One motion at two speeds: what was when, and what was commanded beside what was shown."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from toy_models import DT, toy_demonstration, toy_task

from irlpilco_ros.learning import Task
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.pace import at_moments_of, ways_at_pace_of


def at_speed(speed: float, horizon: int) -> Task:
    return Task((toy_demonstration(horizon=horizon),), DT, np.full(2, 2.0), speed=speed)


SHOWN, FAST, SLOW = at_speed(1.0, 12), at_speed(1.5, 8), at_speed(0.75, 16)


def test_what_was_at_a_moment_is_at_that_moment_whatever_the_speed():
    values = np.stack([np.arange(13.0), 3.0 - np.arange(13.0)], axis=1)
    np.testing.assert_array_equal(at_moments_of(SHOWN, SHOWN, values), values)
    np.testing.assert_allclose(at_moments_of(FAST, SHOWN, values)[:, 0], 1.5 * np.arange(9))
    np.testing.assert_allclose(at_moments_of(SLOW, SHOWN, values)[:, 0], 0.75 * np.arange(17))
    there = at_moments_of(FAST, SHOWN, values)
    np.testing.assert_allclose(at_moments_of(SHOWN, FAST, there), values)
    # What begins before the motion's end and ends after it stays at its end.
    longer = at_speed(1.5, 9)
    np.testing.assert_array_equal(at_moments_of(longer, SHOWN, values)[-1], values[-1])


def test_speeds_are_scaled_so_that_the_way_is_the_same():
    speeds = np.random.default_rng(0).standard_normal((12, 2))
    np.testing.assert_allclose(ways_at_pace_of(SHOWN, SHOWN, speeds), speeds, atol=1e-12)
    for task in (FAST, SLOW):
        scaled = ways_at_pace_of(task, SHOWN, speeds)
        assert scaled.shape == (task.horizon, 2)
        np.testing.assert_allclose(scaled.sum(axis=0), speeds.sum(axis=0))
    steady = ways_at_pace_of(FAST, SHOWN, np.ones((12, 2)))
    np.testing.assert_allclose(steady, 1.5)


def test_a_task_has_a_speed():
    with pytest.raises(InvalidSettingError, match="speed is 0"):
        dataclasses.replace(toy_task(), speed=0.0)
