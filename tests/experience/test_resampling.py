"""Recordings at the ticks of the controller, by their stamps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.experience.resampling import measured_velocities, resample


def cubic(times, seed=0):
    """Two joints on random cubics: what Hermite interpolation gives back exactly."""
    a = np.random.default_rng(seed).normal(size=(4, 2))
    t = times[:, None]
    return a[0] + t * (a[1] + t * (a[2] + t * a[3])), a[1] + t * (2 * a[2] + t * 3 * a[3])


@given(
    steps=st.lists(st.floats(0.01, 0.7), min_size=1, max_size=20),
    parts=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=9),
    seed=st.integers(0, 99),
)
def test_a_cubic_is_given_back_whatever_the_stamps(steps, parts, seed):
    times = np.cumsum([0.3, *steps])
    ticks = times[0] + np.array(parts) * (times[-1] - times[0])
    found = resample(times, cubic(times, seed)[0], cubic(times, seed)[1], ticks)
    np.testing.assert_allclose(found, np.hstack(cubic(ticks, seed)), rtol=1e-6, atol=5e-3)
    near = np.abs(times[:, None] - ticks).min(axis=0) <= 1e-4
    np.testing.assert_allclose(
        found[~near], np.hstack(cubic(ticks, seed))[~near], rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("epoch", [0.0, 1.76e9])
def test_samples_on_the_ticks_stay_as_they_are(epoch):
    rng = np.random.default_rng(3)
    times = epoch + 0.05 * np.arange(161)
    positions, velocities = rng.normal(size=(161, 3)), rng.normal(size=(161, 3))
    found = resample(times, positions, velocities, times[0] + 0.5 * np.arange(17))
    assert np.array_equal(found, np.hstack([positions, velocities])[::10])


def test_beyond_the_recording_the_robot_stands():
    times = np.array([1.0, 2.0])
    positions, velocities = cubic(times)
    found = resample(times, positions, velocities, np.array([0.5, 1.0, 2.0, 2.5]))
    np.testing.assert_array_equal(found[:, :2], positions[[0, 0, 1, 1]])
    np.testing.assert_array_equal(found[[0, 3], 2:], 0.0)
    np.testing.assert_array_equal(found[[1, 2], 2:], velocities)


@pytest.mark.parametrize("rate", [2.0, 20.0, 100.0, 1000.0])
def test_speeds_from_positions(rate):
    times = 5.0 + np.arange(round(4 * rate) + 1) / rate
    times += np.random.default_rng(2).uniform(-0.2, 0.2, len(times)) / rate  # stamps jitter
    noise = 4e-4 * np.random.default_rng(1).standard_normal((len(times), 1))
    found = measured_velocities(times, np.sin(0.7 * times)[:, None] + noise)
    error = np.abs(found[:, 0] - 0.7 * np.cos(0.7 * times))
    whole = (times > times[0] + 0.5) & (times < times[-1] - 0.5)
    assert error[whole].max() < (0.03 if rate == 2.0 else 0.025)
    assert error.max() < (0.1 if rate == 2.0 else 0.05)  # at the ends from one side


def test_a_single_sample_has_no_speed():
    assert np.array_equal(measured_velocities(np.array([3.0]), np.ones((1, 2))), np.zeros((1, 2)))


@given(st.lists(st.floats(0.001, 1.0), min_size=1, max_size=40))
def test_a_steady_speed_is_found_exactly_whatever_the_stamps(steps):
    times = np.cumsum([0.0, *steps])
    found = measured_velocities(times, np.outer(times, [0.3, -1.0]))
    np.testing.assert_allclose(found, np.tile([0.3, -1.0], (len(times), 1)), atol=1e-9)
