from __future__ import annotations

import time

import pytest

from irlpilco_ros.experience.running_clock import RunningClock

HOUR = 3600 * 10**9


class Clocks:
    """A wall clock that can be set, and a steady one."""

    def __init__(self, monkeypatch) -> None:
        self.wall, self.steady = 1_700_000_000 * 10**9, 5 * 10**9
        monkeypatch.setattr(time, "time_ns", lambda: self.wall)
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.steady)

    def pass_by(self, nanoseconds: int) -> None:
        self.wall += nanoseconds
        self.steady += nanoseconds


@pytest.mark.parametrize("change", [-HOUR, HOUR, -2 * 10**9])
def test_times_go_on_when_the_clock_is_set_also_of_what_came_before_that(monkeypatch, change):
    clocks = Clocks(monkeypatch)
    running = RunningClock()
    begin = clocks.wall
    clocks.pass_by(10**9)
    assert running.mended(clocks.wall) == begin + 10**9
    before = clocks.wall
    clocks.pass_by(10**6)
    clocks.wall += change
    assert running.mended(before) == before, "it waited in a queue while the clock was set"
    assert running.mended(clocks.wall) == begin + 10**9 + 10**6
    clocks.pass_by(5 * 10**9)
    assert running.mended(clocks.wall - 7) == begin + 6 * 10**9 + 10**6 - 7
