"""A trial that leaves what was predicted of it stops the robot."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.control.band_guard import NEAR, BandGuard
from irlpilco_ros.control.controller_settings import ControllerSettings, changed_guards
from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.control.motions import MotionStoppedError, Trial
from irlpilco_ros.experience.predicted_band import PredictedBand
from irlpilco_ros.learning.joints import Joints

JOINTS = Joints(("lift", "spin"), continuous=("spin",))
BAND = PredictedBand(
    np.array([[0.0, 0.0], [0.1, 3.0], [0.2, 6.2]]),
    np.array([[0.0, 0.0], [0.01, 0.01], [0.02, 0.0]]),
)


def is_stopped(tick, positions, sigma=3.0):
    try:
        BandGuard(JOINTS, BAND, sigma).check(tick, np.array(positions))
    except MotionStoppedError:
        return True
    return False


def test_inside_the_band_and_near_it_a_trial_goes_on():
    assert not is_stopped(1, [0.1 + 0.029, 3.0 - 0.029])
    assert not is_stopped(2, [0.2 - 0.059, 6.2])
    assert not is_stopped(0, [0.9 * NEAR, -0.9 * NEAR]), "nothing is predicted that exactly"


def test_outside_the_band_it_ends_on_either_side():
    assert is_stopped(1, [0.1 + 0.031, 3.0])
    assert is_stopped(1, [0.1 - 0.031, 3.0])
    assert is_stopped(0, [0.0, 1.1 * NEAR])
    assert not is_stopped(1, [0.1 + 0.031, 3.0], sigma=4.0)


def test_full_turns_are_no_distance():
    assert not is_stopped(1, [0.1, 3.0 - 2.0 * np.pi])
    assert is_stopped(1, [0.1, 3.0 - np.pi])


def test_it_names_the_joint_that_is_farthest_outside():
    guard = BandGuard(JOINTS, BAND, 3.0)
    with pytest.raises(MotionStoppedError, match=r"joint spin is 0.5000 rad .* tick 1, 3.0000"):
        guard.check(1, np.array([0.2, 3.5]))


class Still:
    def act(self, state, step):
        return np.zeros(2)


def test_a_trial_is_looked_at_at_every_tick_its_last_one_included():
    """And between them it is not: there is no prediction."""
    seen = []

    class Watcher:
        def check(self, tick, positions):
            seen.append((tick, positions[0]))

    trial = Trial(Still(), 2, 0.02, Watcher())
    for state in range(5):
        reading = JointReading(state * 10_000_000, np.array([float(state), 0.0]), np.zeros(2))
        done = trial.command(reading).done
    assert done
    assert seen == [(0, 0.0), (1, 2.0), (2, 4.0)]


def test_another_sigma_ends_what_it_guards():
    before, after = ControllerSettings(), ControllerSettings(guard_sigma=4.0)
    assert changed_guards(before, after) == "guard_sigma from 0 to 4"
