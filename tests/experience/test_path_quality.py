from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from irlpilco_ros.experience.path_quality import PathQuality, accelerations, path_of, path_quality
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints

NAMES = ("elbow", "wrist")
JOINTS = Joints(NAMES)
START = 1_700_000_000.0  # [s]


def recorded(positions, velocities, step: float = 0.01, start: float = START) -> Trajectory:
    stamps = start + step * np.arange(len(positions))
    return Trajectory(NAMES, stamps, positions, velocities, np.full_like(positions, np.nan))


def waving(times: np.ndarray, amplitude: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    phase = 2.0 * times[:, None] + np.array([0.0, 0.7])
    return amplitude * np.sin(phase), 2.0 * amplitude * np.cos(phase)


TIMES = 0.01 * np.arange(801)
SHOWN = path_of(recorded(*waving(TIMES)), JOINTS, START, 8.0)


def test_the_demonstration_itself_is_exactly_there_and_as_hard_as_its_curve():
    found = path_quality(SHOWN, [SHOWN], JOINTS)
    assert found.rmse == found.largest == 0.0
    assert found.acceleration_max == pytest.approx(4.0 * 0.5, rel=0.01)
    assert found.acceleration_p99 == pytest.approx(4.0 * 0.5, rel=0.01)


def test_errors_are_those_of_all_states_at_the_same_time_since_the_start():
    """A trial with another clock and other times of its states, late by 50 ms."""
    times = 0.0137 * np.arange(584)
    positions, velocities = waving(times - 0.05)
    trial = path_of(recorded(positions, velocities, 0.0137, 77.0), JOINTS, 77.0, 8.0)
    found = path_quality(trial, [SHOWN], JOINTS)
    off = waving(times - 0.05)[0] - waving(times)[0]
    assert found.rmse == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-3)
    assert found.largest == pytest.approx(np.abs(off).max(), rel=1e-3)


def test_a_velocity_that_jumps_between_the_ticks_is_seen():
    """Held for 0.5 s each, as a policy does at 2 Hz: exact at the ticks."""
    ticks = waving(0.5 * np.arange(17))[0]
    held = np.stack([np.interp(TIMES, 0.5 * np.arange(17), column) for column in ticks.T], axis=1)
    speeds = np.repeat(np.diff(ticks, axis=0) / 0.5, 50, axis=0)
    speeds = np.vstack([speeds, speeds[-1:]])
    found = path_quality(path_of(recorded(held, speeds), JOINTS, START, 8.0), [SHOWN], JOINTS)
    np.testing.assert_allclose(held[::50], ticks, atol=1e-12)
    jump = np.abs(np.diff(speeds, axis=0)).max()
    assert found.acceleration_max == pytest.approx(jump / 0.05, rel=1e-6)
    assert found.acceleration_max > 10.0 * found.rmse
    assert 0.02 < found.largest < 0.07


def test_only_the_motion_counts_not_what_came_before_or_after():
    positions, velocities = waving(0.01 * np.arange(-200, 1001))
    found = path_of(recorded(positions, velocities), JOINTS, START + 2.0, 8.0)
    assert found is not None
    np.testing.assert_allclose(found.times, TIMES, atol=2e-6)
    assert path_quality(found, [SHOWN], JOINTS).largest < 1e-5


def test_several_demonstrations_are_imitated_in_their_mean():
    one = path_of(recorded(*waving(TIMES, 0.4)), JOINTS, START, 8.0)
    other = path_of(recorded(*waving(TIMES, 0.6)), JOINTS, START, 8.0)
    assert path_quality(SHOWN, [one, other], JOINTS).largest < 1e-12


def test_full_turns_of_a_continuous_joint_are_no_error():
    turning = Joints(NAMES, continuous=("wrist",))
    positions = np.stack([np.zeros(801), TIMES], axis=1)
    wrapped = np.stack([np.zeros(801), (TIMES + np.pi) % (2.0 * np.pi) - np.pi], axis=1)
    speeds = np.tile([0.0, 1.0], (801, 1))
    shown = path_of(recorded(positions, speeds), turning, START, 8.0)
    trial = path_of(recorded(wrapped, speeds), turning, START, 8.0)
    assert path_quality(trial, [shown], turning).largest < 1e-9


def test_samples_alone_make_no_path():
    coarse = recorded(*waving(0.5 * np.arange(17)), 0.5)
    assert path_of(coarse, JOINTS, START, 8.0) is None
    assert path_quality(SHOWN, [None], JOINTS).acceleration_max == pytest.approx(2.0, rel=0.01)
    assert math.isnan(path_quality(SHOWN, [None], JOINTS).rmse)
    assert all(math.isnan(each) for each in vars(path_quality(None, [SHOWN], JOINTS)).values())
    assert all(math.isnan(each) for each in vars(PathQuality()).values())


def test_no_acceleration_is_made_of_a_gap_or_of_speeds_that_were_not_told():
    gap = np.r_[0:300, 400:801]
    holed = replace(
        SHOWN,
        times=SHOWN.times[gap],
        positions=SHOWN.positions[gap],
        velocities=SHOWN.velocities[gap],
    )
    assert len(accelerations(holed)) == 300 - 5 + 401 - 5
    silent = replace(SHOWN, velocities=np.full_like(SHOWN.velocities, np.nan))
    assert math.isnan(path_quality(silent, [SHOWN], JOINTS).acceleration_max)
    assert path_quality(silent, [SHOWN], JOINTS).rmse == 0.0
