"""Motions of the guiding hand: through the waypoints, smooth, and read from files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from irlpilco_ros.learning.errors import InvalidSettingError
from sim_bridge.guided_motion import GuidedMotion, MinimumJerk
from sim_bridge.motion_files import BY_HAND, CORNERED, load_motion

MOTIONS: dict[str, Any] = {
    "cornered": load_motion(CORNERED),
    "by hand": load_motion(BY_HAND),
    "approach": MinimumJerk.within_speed([0.0, 1.0], [0.5, -1.0], speed=0.4),
}


def test_the_cornered_sweep_passes_its_waypoints() -> None:
    motion = load_motion(CORNERED)
    assert motion.waypoints.shape == (17, 14)
    assert motion.duration == 8.0
    passed = [motion.at(k * motion.interval)[0] for k in range(17)]
    assert np.abs(passed - motion.waypoints).max() < 6e-3


def test_a_hand_is_smooth_trembles_and_rests_at_both_ends() -> None:
    motion = load_motion(BY_HAND)
    times = np.arange(0.0, motion.duration, 0.01)
    velocities = np.array([motion.at(time)[1] for time in times])
    accelerations = np.diff(velocities, axis=0) / 0.01
    assert 1.0 < np.abs(accelerations).max() < 3.0
    assert np.abs(velocities[[0, -1]]).max() < 0.05
    spectrum = np.abs(np.fft.rfft(velocities[:, 3] * np.hanning(len(times))))
    frequencies = np.fft.rfftfreq(len(times), 0.01)
    trembles = spectrum[(frequencies > 6.0) & (frequencies < 9.0)].max()
    assert trembles > 10.0 * spectrum[frequencies > 11.0].max()
    passed = [
        np.abs([motion.at(t)[0] - w for t in times]).max(axis=1).min() for w in motion.waypoints
    ]
    assert max(passed) < 0.1, "it cuts corners, but not far from any waypoint"


def test_the_cornered_sweep_is_straight_between_waypoints() -> None:
    motion = load_motion(CORNERED)
    for k in range(16):
        first, last = motion.waypoints[k : k + 2]
        positions, velocities = motion.at((k + 0.3) * motion.interval)
        np.testing.assert_allclose(positions, first + 0.3 * (last - first), atol=1e-12)
        np.testing.assert_allclose(velocities, (last - first) / motion.interval, atol=1e-12)


@pytest.mark.parametrize("name", MOTIONS)
def test_velocity_is_the_derivative_of_position(name: str) -> None:
    motion = MOTIONS[name]
    step = 1e-6
    for moment in np.random.default_rng(0).uniform(-0.1, motion.duration + 0.1, 200):
        difference = (motion.at(moment + step)[0] - motion.at(moment - step)[0]) / (2 * step)
        np.testing.assert_allclose(motion.at(moment)[1], difference, atol=1e-5)


@pytest.mark.parametrize("name", MOTIONS)
def test_velocity_does_not_jump(name: str) -> None:
    motion = MOTIONS[name]
    times = np.arange(-0.1, motion.duration + 0.1, 0.001)
    velocities = np.array([motion.at(moment)[1] for moment in times])
    assert np.abs(np.diff(velocities, axis=0)).max() < 0.03
    assert np.abs(velocities[0]).max() == np.abs(velocities[-1]).max() == 0.0


@given(
    start=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    goal=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    speed=st.floats(0.05, 1.5),
)
@settings(max_examples=50, deadline=None)
def test_approach_ends_at_the_goal_within_the_speed(
    start: list[float], goal: list[float], speed: float
) -> None:
    approach = MinimumJerk.within_speed(start, goal, speed)
    np.testing.assert_allclose(approach.at(0.0)[0], start, atol=1e-12)
    np.testing.assert_allclose(approach.at(approach.duration)[0], goal, atol=1e-12)
    moments = np.linspace(0.0, approach.duration, 101)
    velocities = np.array([approach.at(moment)[1] for moment in moments])
    assert np.abs(velocities).max() <= speed * (1 + 1e-9)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"positions": [[0.0] * 14]}, "at least 2 rows"),
        ({"positions": [[0.0] * 13 for _ in range(3)]}, "of 14 positions"),
        ({"positions": [[0.0] * 14, [float("nan")] * 14]}, "waypoint 1 is not finite"),
        ({"positions": [[0.0] * 14, [0.0] * 2]}, "cannot read a motion"),
        ({"interval": 0.0}, "expected more than 0"),
        ({"course": "bent"}, "course: hand or straight"),
        ({"joints": None}, "cannot read a motion"),
    ],
)
def test_files_that_make_no_sense_are_refused(
    tmp_path: Path, change: dict[str, object], reason: str
) -> None:
    document = yaml.safe_load(CORNERED.read_text()) | change
    path = tmp_path / "motion.yaml"
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(InvalidSettingError, match=reason):
        load_motion(path)


def test_a_few_lines_that_stand_for_gigabytes_are_refused(tmp_path: Path) -> None:
    bomb = tmp_path / "bomb.yaml"
    bomb.write_text("a: &a [0, 0]\nb: &b [*a, *a]\npositions: [*b, *b]\n")
    with pytest.raises(InvalidSettingError, match="alias"):
        load_motion(bomb)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidSettingError, match=r"nowhere\.yaml"):
        load_motion(tmp_path / "nowhere.yaml")


def test_motion_checks_its_shape() -> None:
    with pytest.raises(InvalidSettingError, match=r"shape \(3,\)"):
        GuidedMotion(("a", "b", "c"), 0.5, np.zeros(3))
