"""Where the motion in a recording begins and ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.motion import MotionSettings, find_motion, unwrapped
from irlpilco_ros.resources import recording

JOINTS = ("shoulder", "elbow", "wrist")
NOISE = 0.0004  # [rad], of the simulated Baxter
SWEEP = recording("cornered_sweep") / "demonstration"


def smooth(fraction):
    """From 0 to 1 with little jerk, as a hand moves."""
    s = np.clip(fraction, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def recorded(begin, duration, after, rate, seed=0, distance=0.5, epoch=0.0):
    """The shoulder moves first, for all but the last tenth, the wrist for all but the first."""
    times = np.arange(round((begin + duration + after) * rate) + 1) / rate
    part = (times - begin) / duration
    way = [smooth(part / 0.9), np.zeros_like(times), smooth((part - 0.1) / 0.9)]
    noise = NOISE * np.random.default_rng(seed).standard_normal((len(times), 3))
    return epoch + times, np.array([0.3, -1.0, 0.8]) + distance * np.stack(way, axis=1) + noise


@given(
    begin=st.floats(0.6, 4.0),
    duration=st.floats(2.0, 10.0),
    after=st.floats(0.6, 4.0),
    rate=st.sampled_from([20.0, 100.0, 500.0]),
    seed=st.integers(0, 1000),
    epoch=st.sampled_from([0.0, 1.76e9]),
)
def test_a_motion_is_found_in_noise(begin, duration, after, rate, seed, epoch):
    times, positions = recorded(begin, duration, after, rate, seed, epoch=epoch)
    motion = find_motion(times, positions, JOINTS, MotionSettings())
    # A smooth motion creeps at first: what counts is how little of the way is left out.
    before = positions[times - times[0] <= motion.begin]
    behind = positions[times - times[0] >= motion.end]
    left_out = 0.005 + 8.0 * NOISE  # both ends are noisy readings, of thousands
    assert np.abs(before - positions[0]).max() < left_out
    assert np.abs(behind - positions[-1]).max() < left_out
    assert begin - 0.2 < motion.begin < begin + 0.13 * duration + 0.1
    assert begin + 0.87 * duration - 0.1 < motion.end < begin + duration + 0.2
    assert (motion.first_joint, motion.last_joint) == ("shoulder", "wrist")
    assert motion.recorded == pytest.approx(times[-1] - times[0])


def test_a_sudden_motion_is_found_to_some_samples():
    times = np.arange(1131) / 100.0
    positions = np.interp(times, [1.9, 10.0], [0.0, 2.0])[:, None]
    motion = find_motion(times, positions, ("a",), MotionSettings())
    assert motion.begin == pytest.approx(1.9, abs=0.03)
    assert motion.end == pytest.approx(10.0, abs=0.03)
    assert motion.sentence() == (
        f"{motion.duration:.1f} s of motion, from {motion.begin:.1f} s to {motion.end:.1f} s of "
        "11.3 s; first joint to move: a, last: a"
    )


def test_a_recording_without_standstill_is_whole():
    shown = read_bag(SWEEP)
    motion = find_motion(shown.stamps, shown.positions, shown.joint_names, MotionSettings())
    assert (motion.begin, motion.end) == (0.0, 8.0)
    assert motion.first_joint in shown.joint_names


@pytest.mark.parametrize(("before", "after"), [(0, 0), (1, 0), (0, 1), (4, 3)])
def test_samples_as_far_apart_as_decisions_are_cut_at_samples(before, after):
    shown = read_bag(SWEEP)
    still = [shown.positions[:1]] * before, [shown.positions[-1:]] * after
    positions = np.vstack([*still[0], shown.positions, *still[1]])
    times = np.arange(0.0, 0.5 * len(positions), 0.5)
    motion = find_motion(times, positions, shown.joint_names, MotionSettings())
    assert (motion.begin, motion.end) == (0.5 * before, 0.5 * before + 8.0)


def test_a_pause_belongs_to_the_motion():
    times = np.arange(901) / 100.0
    positions = np.interp(times, [1.0, 2.0, 6.0, 7.0], [0.0, 0.5, 0.5, 0.0])[:, None]
    motion = find_motion(times, positions, ("a",), MotionSettings())
    assert motion.begin == pytest.approx(1.0, abs=0.03)
    assert motion.end == pytest.approx(7.0, abs=0.03)


def test_noise_and_creeping_are_no_motion():
    times = np.arange(3001) / 100.0
    noise = NOISE * np.random.default_rng(1).standard_normal((len(times), 14))
    names = tuple(f"joint{k}" for k in range(14))
    assert find_motion(times, noise, names, MotionSettings()) is None
    creeping = noise + 0.0001 * times[:, None]
    assert find_motion(times, creeping, names, MotionSettings()) is None
    moving = creeping.copy()
    moving[:, 3] += 0.5 * smooth((times - 15.0) / 5.0)
    assert find_motion(times, moving, names, MotionSettings()).begin == pytest.approx(15.5, abs=0.5)


@pytest.mark.parametrize("samples", [0, 1])
def test_too_little_is_no_motion(samples):
    times = np.arange(float(samples))
    assert find_motion(times, np.zeros((samples, 1)), ("a",), MotionSettings()) is None


def test_the_settings_say_what_counts():
    times = np.arange(1001) / 100.0
    slow = np.interp(times, [2.0, 8.0], [0.0, 0.06])[:, None]  # 0.01 rad/s
    found = find_motion(times, slow, ("a",), MotionSettings(motion_speed=0.005))
    assert (found.begin, found.end) == pytest.approx((2.0, 8.0), abs=0.2)
    assert find_motion(times, slow, ("a",), MotionSettings(motion_distance=0.1)) is None


def test_a_wrap_of_a_continuous_joint_is_no_motion():
    times = np.arange(501) / 100.0
    still = np.full((len(times), 1), np.pi)
    still[250:] = -np.pi
    assert find_motion(times, still, ("a",), MotionSettings()) is not None
    assert find_motion(times, still, ("a",), MotionSettings(), continuous=("a",)) is None


@given(st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=30), st.floats(-9.0, 9.0))
def test_unwrapped_turns_by_less_than_half_a_turn(steps, start):
    way = start + np.cumsum(np.array([0.0, *steps]))
    seen = np.stack([np.angle(np.exp(1j * way)), way], axis=1)
    found = unwrapped(seen, ("turning", "other"), ("turning",))
    assert np.allclose(np.diff(found[:, 0]), np.diff(way))
    assert np.array_equal(found[:, 1], way)
    assert np.array_equal(unwrapped(seen, ("a", "b"), ()), seen)
