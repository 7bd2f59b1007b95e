"""Smooth ways: where they end, and the bounds that they keep."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.control.rest_to_rest import RestToRest

SPEED = np.array([0.4, 0.2])


@given(
    way=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    acceleration=st.floats(0.1, 20.0),
)
def test_the_way_is_gone_within_speed_and_acceleration(way, acceleration):
    motion = RestToRest.within(np.array(way), SPEED, acceleration)
    times = np.linspace(0.0, motion.duration, 2001)
    speeds = np.array([motion.velocities(time) for time in times])
    np.testing.assert_allclose(np.trapezoid(speeds, times, axis=0), way, atol=1e-4)
    assert (np.abs(speeds) <= SPEED * (1.0 + 1e-9)).all()
    if motion.duration > 1e-6:
        steepest = np.abs(np.diff(speeds, axis=0)).max() / (times[1] - times[0])
        assert steepest <= acceleration * (1.0 + 1e-6)
    for outside in (-0.1, 0.0, motion.duration, motion.duration + 1.0):
        assert not motion.velocities(outside).any()


def test_a_long_way_goes_at_full_speed_and_a_short_one_at_full_acceleration():
    long = RestToRest.within(np.array([2.0, 0.5]), SPEED, 2.0)
    np.testing.assert_allclose(long.velocities(long.duration / 2.0), [0.4, 0.1])
    assert long.duration == pytest.approx(2.0 / 0.4 + 0.5 * np.pi * 0.4 / 2.0)
    short = RestToRest.within(np.array([0.001, 0.0]), SPEED, 2.0)
    assert short.cruise == 0.0
    assert 0.0 < short.velocities(short.blend)[0] < 0.4


def test_no_way_takes_no_time_and_next_to_none_is_gone():
    next_to_none = RestToRest.within(np.array([5e-324, 0.0]), SPEED, 0.25)
    assert next_to_none.duration < 1e-6
    assert RestToRest.within(np.zeros(2), SPEED, 2.0).duration == 0.0
