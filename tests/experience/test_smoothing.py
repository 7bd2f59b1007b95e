"""States at the ticks have less noise than single readings, and no delay."""

import numpy as np

from irlpilco_ros.experience.smoothing import WINDOW, smoothed_states

TIMES = np.arange(0.0, 2.0, 0.01)
TICKS = np.arange(0.0, 2.0, 0.25)


def motion(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    positions = np.stack([0.3 * np.sin(2.0 * times), times**2], axis=1)
    return positions, np.stack([0.6 * np.cos(2.0 * times), 2.0 * times], axis=1)


def test_a_motion_without_noise_is_given_back() -> None:
    states = smoothed_states(TIMES, *motion(TIMES), TICKS)
    np.testing.assert_allclose(states, np.hstack(motion(TICKS)), atol=2e-5)


def test_noise_is_less_in_positions_and_velocities() -> None:
    rng = np.random.default_rng(0)
    off = []
    for _ in range(40):
        positions, velocities = motion(TIMES)
        noisy = positions + 4e-4 * rng.standard_normal(positions.shape)
        speeds = velocities + 5e-3 * rng.standard_normal(velocities.shape)
        off.append(smoothed_states(TIMES, noisy, speeds, TICKS) - np.hstack(motion(TICKS)))
    spread = np.std(off, axis=(0, 1))
    assert (spread[:2] < 2.5e-4).all()
    assert (spread[2:] < 4e-3).all()


def test_stamps_that_are_not_even_are_taken_as_they_are() -> None:
    rng = np.random.default_rng(1)
    times = np.sort(rng.uniform(0.0, 2.0, 300))
    states = smoothed_states(times, *motion(times), TICKS[1:-1])
    np.testing.assert_allclose(states, np.hstack(motion(TICKS[1:-1])), atol=3e-4)


def test_too_few_readings_are_no_state() -> None:
    times = np.concatenate([TIMES[TIMES < 0.9], [1.0]])
    states = smoothed_states(times, *motion(times), np.array([0.5, 1.0]))
    assert np.isfinite(states[0]).all()
    assert np.isnan(states[1]).all()
    assert WINDOW < 0.1
