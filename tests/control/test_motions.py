"""Trials tick by tick, and the way to the start on servos that lag."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robot_of_two import JOINTS, ROBOT, nanoseconds, reading

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motions import Approach, MotionStoppedError, Trial


class Counting:
    """A policy that tells its step and the state it saw."""

    def act(self, state, step):
        return np.array([step + 1.0, state[0]])


class Failing:
    def act(self, state, step):
        raise ZeroDivisionError("a slip of the pen")


def test_a_policy_that_fails_stops_the_trial_with_the_reason():
    with pytest.raises(MotionStoppedError, match="the policy failed at tick 0: a slip of the pen"):
        Trial(Failing(), 3, 0.1).command(reading(1.0))


def run(trial, times):
    """Ask the trial at these times, the elbow's position being the time."""
    commands = []
    for time in times:
        commands.append(trial.command(reading(time, (time, 0.0))))
        if commands[-1].done:
            break
    return commands


@given(
    begin=st.floats(0.0, 1e5),
    gaps=st.lists(st.floats(0.003, 0.09), min_size=1, max_size=20),
    horizon=st.integers(1, 5),
)
def test_tick_k_is_the_first_state_at_or_after_k_periods(begin, gaps, horizon):
    times = begin + np.concatenate([[0.0], np.cumsum(np.resize(gaps, 200))])
    stamps = [nanoseconds(time) for time in times]
    commands = run(Trial(Counting(), horizon, 0.1), times)
    due = [stamps[0] + tick * nanoseconds(0.1) for tick in range(horizon + 1)]
    ticks = [next(stamp for stamp in stamps if stamp >= when) for when in due]
    assert list(dict.fromkeys(command.stamp for command in commands)) == ticks
    for command, stamp in zip(commands[:-1], stamps, strict=False):
        tick = max(i for i, first in enumerate(ticks) if first <= stamp)
        assert command.values[0] == tick + 1
        assert nanoseconds(command.values[1]) == command.stamp == ticks[tick]
    assert commands[-1].done
    assert not commands[-1].values.any()


def test_a_lost_tick_stops_the_trial():
    trial = Trial(Counting(), 5, 0.1)
    run(trial, [0.0, 0.05])
    with pytest.raises(MotionStoppedError, match=r"jumped over tick 1 by 0\.150 s"):
        trial.command(reading(0.25))


def test_a_trial_sums_itself_up():
    trial = Trial(Counting(), 4, 0.5)
    run(trial, np.arange(0.0, 3.0, 0.01))
    assert trial.summary() == "trial over: 4 decisions in 2 s"


def servo(approach, start, lag, delay, noise=0.0, seconds=20.0, seed=0):
    """Run an approach on first-order servos with a command delay; return times and velocities."""
    random = np.random.default_rng(seed)
    position, velocity = np.array(start, dtype=float), np.zeros(2)
    pipeline = deque([np.zeros(2)] * (1 + round(delay / 0.01)))
    commands = []
    for step in range(round(seconds / 0.01)):
        seen = position + noise * random.standard_normal(2)
        speed = velocity + 10.0 * noise * random.standard_normal(2)
        command = approach.command(reading(0.01 * step, seen, speed))
        commands.append(command.values)
        if command.done:
            return position, np.array(commands)
        pipeline.append(command.values)
        velocity = velocity + (pipeline.popleft() - velocity) * 0.01 / lag
        position = position + velocity * 0.01
    raise AssertionError("never arrived")


@pytest.mark.parametrize(("lag", "delay"), [(0.02, 0.0), (0.08, 0.05), (0.1, 0.1)])
def test_the_approach_arrives_on_slow_servos_within_its_limits(lag, delay):
    settings = ControllerSettings(approach_speed=0.5)
    limit = np.array([1.0, 0.2])
    goal = np.array([0.6, -0.5])
    approach = Approach(JOINTS, goal, limit, settings)
    position, commands = servo(approach, (-0.4, 0.3), lag, delay, noise=4e-4)
    np.testing.assert_allclose(position, goal, atol=settings.start_tolerance + 2e-3)
    assert (np.abs(commands) <= np.minimum(limit, 0.5) + 1e-12).all()
    assert np.abs(np.diff(commands, axis=0)[:10]).max() <= 0.01 * 2.0 + 1e-9, "gentle start"
    assert not commands[-1].any()
    # Far from the goal the way is straight: both joints cover their distance alike.
    np.testing.assert_allclose(commands[10, 0] / commands[10, 1], 1.0 / -0.8, rtol=0.02)


def test_an_approach_that_does_not_arrive_names_the_joint():
    settings = ControllerSettings(approach_timeout=1.0)
    approach = Approach(JOINTS, np.array([0.5, 0.5]), ROBOT.control_limit, settings)
    approach.command(reading(0.0, (0.5, 0.2)))
    with pytest.raises(MotionStoppedError, match=r"wrist is farthest, 0\.3000 rad away"):
        approach.command(reading(1.1, (0.5, 0.2)))


def test_an_approach_waits_for_standstill():
    approach = Approach(JOINTS, np.zeros(2), ROBOT.control_limit, ControllerSettings())
    assert not approach.command(reading(0.0, (0.0, 0.001), (0.0, 0.1))).done
    assert approach.command(reading(0.1, (0.0, 0.001), (0.0, 0.01))).done
