"""What was done between the samples: it is what pictures and debris are made of."""

from __future__ import annotations

import dataclasses
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest
from report_runs import summary

from irlpilco_ros.experience import metrics
from irlpilco_ros.experience.path_quality import MotionPath
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.report import sweeps
from irlpilco_ros.report.courses import TRIAL, course, course_of_trial
from irlpilco_ros.report.resimulation import count_debris, film
from irlpilco_ros.report.sweeps import SweepJobs
from sim_bridge.guided_motion import GuidedMotion
from sim_bridge.recorded_motion import RecordedMotion

NAMES = ("left_s0", "right_s0")
JOINTS = Joints(NAMES)
TICKS = 0.5 * np.arange(5)


def motion(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities: at the ticks nothing moves, between them an arm swings out."""
    phase = 2.0 * np.pi * times / 0.5
    swing = 0.02 * (1.0 - np.cos(phase))[:, None] * np.array([1.0, -1.0])
    return swing, 0.02 * 2.0 * np.pi / 0.5 * np.sin(phase)[:, None] * np.array([1.0, -1.0])


def recorded(step: float, begin: float = 1.0) -> Trajectory:
    """A recording that begins a second before the motion of 2 s, and ends one after it."""
    times = np.arange(round(4.0 / step) + 1) * step - begin
    positions, velocities = motion(times)
    rng = np.random.default_rng(0)
    positions = positions + 4e-4 * rng.standard_normal(positions.shape)
    velocities = velocities + 5e-3 * rng.standard_normal(velocities.shape)
    commands = np.full(positions.shape, np.nan)
    commands[np.abs(times[:, None] - TICKS).min(axis=1) < 1e-9] = 0.0
    return Trajectory(NAMES, 100.0 + times, positions, velocities, commands)


def test_a_course_is_what_was_done_between_the_ticks_without_the_noise():
    found = course_of_trial(recorded(0.01), JOINTS)
    assert found is not None
    assert (found.times[0], found.times[-1]) == (0.0, pytest.approx(2.0))
    done = motion(found.times)
    assert np.abs(done[0]).max() == pytest.approx(0.04, abs=3e-4)
    assert np.sqrt(np.mean((found.positions - done[0]) ** 2)) < 2.5e-4
    assert np.sqrt(np.mean((found.velocities - done[1]) ** 2)) < 5e-3
    same = course(recorded(0.01), JOINTS, 100.0, 2.0)
    np.testing.assert_array_equal(found.positions, same.positions)


def test_samples_alone_are_no_course():
    assert course_of_trial(recorded(0.5), JOINTS) is None


def test_a_recorded_motion_goes_through_its_states_and_rests_at_both_ends():
    times = np.linspace(0.0, 2.0, 101)
    again = RecordedMotion(NAMES, times, *motion(times))
    assert again.duration == 2.0
    for moment in (0.13, 0.5, 1.777):
        done = motion(np.array([moment]))
        np.testing.assert_allclose(again.at(moment)[0], done[0][0], atol=1e-5)
        np.testing.assert_allclose(again.at(moment)[1], done[1][0], atol=2e-3)
    for moment, end in ((-1.0, 0), (3.0, -1)):
        np.testing.assert_allclose(again.at(moment)[0], motion(times)[0][end], atol=1e-12)
        assert not again.at(moment)[1].any()


def test_debris_is_swept_by_what_was_done_and_by_samples_where_no_more_is_known(monkeypatch):
    swept: dict[Any, list[Any]] = {}

    class Pool(Executor):
        def submit(self, function: Any, /, *arguments: Any, **_: Any) -> Future[Any]:
            swept.setdefault(function, []).append(arguments[0])
            return Future()

    monkeypatch.setattr(sweeps, "DEBRIS_SEEDS", (0,))
    times = np.linspace(0.0, 2.0, 101)
    done = MotionPath(times, *motion(times))
    run = dataclasses.replace(summary(NAMES), courses={metrics.DEMONSTRATION: done, TRIAL: done})
    SweepJobs.submit(run, Pool())
    demonstration, replay, learned = swept[count_debris]
    for each in (demonstration, learned, *swept[film]):
        assert isinstance(each, RecordedMotion)
        np.testing.assert_allclose(each.at(0.25)[0], [0.04, -0.04], atol=1e-6)
    assert isinstance(replay, GuidedMotion)
    np.testing.assert_allclose(replay.at(0.25)[0], run.replay[:2].mean(axis=0))
