"""Delay and lag from one way, and how long it takes to settle."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.control.lateness import Lateness
from irlpilco_ros.control.rest_to_rest import RestToRest

STEP = 0.01  # [s]


def watch(way, delay, lag, gain=1.0, noise=4e-4):
    """Let a servo go a way, and watch it for a second longer than it takes to settle."""
    random = np.random.default_rng(0)
    motion = RestToRest.within(np.array(way), np.full(2, 0.4), 2.0)
    lateness = Lateness()
    lateness.begin(motion.way, 0.4)
    position, velocity, commanded = np.zeros(2), np.zeros(2), np.zeros(2)
    share = 1.0 if lag == 0.0 else 1.0 - np.exp(-STEP / lag)
    for step in range(round((motion.duration + delay + 5.0 * lag) / STEP) + 20):
        time = STEP * step
        seen = position + noise * random.standard_normal(2)
        lateness.take(time, seen, commanded)
        velocity = velocity + share * (gain * motion.velocities(time - delay) - velocity)
        position = position + STEP * velocity
        commanded = commanded + STEP * motion.velocities(time)
    return lateness


@pytest.mark.parametrize("gain", [0.7, 1.3])
@pytest.mark.parametrize(
    ("delay", "lag"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.3), (0.1, 0.3), (0.3, 0.3)]
)
def test_delay_and_lag_are_told_apart(delay, lag, gain):
    lateness = watch((0.8, -0.3), delay, lag, gain)
    settling = lateness.settling()
    assert lateness.mean == pytest.approx(delay + lag, abs=0.03)
    assert lateness.lag == pytest.approx(lag, abs=0.08)
    needed = delay + lag * np.log(max(1.0, 0.75 * 0.4 * lag / 0.0007))
    assert settling == pytest.approx(needed, abs=0.35)
    assert (lateness.remainder > 0.0) == (lag > 0.0)


def test_a_short_way_tells_nothing_but_settles_by_what_is_known():
    lateness = watch((0.01, 0.0), 0.3, 0.3)
    assert lateness.settling() == 0.0
    known = watch((0.8, 0.0), 0.3, 0.3)
    long = known.settling()
    known.begin(np.array([0.01, 0.0]), 0.4)
    assert 0.3 < known.settling() < long


def test_a_robot_that_does_not_move_is_not_taken_for_one_that_is_very_late():
    lateness = watch((0.8, 0.0), 0.0, 0.0, gain=0.0)
    lateness.settling()
    assert 0.0 <= lateness.mean <= 2.0
