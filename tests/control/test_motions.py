"""Trials tick by tick."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robot_of_two import nanoseconds, reading

from irlpilco_ros.control.motions import MotionStoppedError, Trial


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


def test_every_tick_is_told_with_its_stamp():
    told = []
    trial = Trial(Counting(), 3, 0.1, on_tick=lambda tick, stamp: told.append((tick, stamp)))
    run(trial, [0.0, 0.05, 0.1, 0.15, 0.21, 0.3, 0.4])
    assert told == [(tick, nanoseconds(time)) for tick, time in enumerate((0.0, 0.1, 0.21, 0.3))]


def test_a_trial_sums_itself_up():
    trial = Trial(Counting(), 4, 0.5)
    run(trial, np.arange(0.0, 3.0, 0.01))
    assert trial.summary() == "trial over: 4 decisions in 2 s"
