"""Simulated time against a wall clock of the test's own: no computer is too busy for it."""

from __future__ import annotations

import threading

import pytest

from sim_bridge import pacemaker as module
from sim_bridge.pacemaker import Pacemaker


class WallClock:
    """Stands for the module `time` and for the event that is waited for."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    wait = sleep


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> WallClock:
    clock = WallClock()
    monkeypatch.setattr(module, "time", clock)
    return clock


def test_beats_take_their_wall_time(clock):
    pacemaker = Pacemaker(0.01, 2.0, clock)
    for beat in range(40):
        if beat == 10:
            clock.sleep(0.05)  # a delay that can be caught up
        pacemaker.wait()
    assert clock.now == pytest.approx(100.2)
    assert pacemaker.seconds_lost == 0.0


def test_a_long_delay_is_given_up_and_counted(clock):
    pacemaker = Pacemaker(0.01, 1.0, clock)
    clock.sleep(0.4)
    pacemaker.wait()
    assert pacemaker.seconds_lost == pytest.approx(0.39)
    assert clock.now == pytest.approx(100.4)
    pacemaker.wait()
    assert clock.now == pytest.approx(100.41)


def test_as_fast_as_it_goes_never_waits(clock):
    pacemaker = Pacemaker(0.01, 0.0, clock)
    for _ in range(100):
        pacemaker.wait()
    assert clock.now == 100.0


def test_stop_ends_a_wait() -> None:
    stop = threading.Event()
    pacemaker = Pacemaker(600.0, 1.0, stop)
    waiting = threading.Thread(target=pacemaker.wait, daemon=True)
    waiting.start()
    stop.set()
    waiting.join(60.0)
    assert not waiting.is_alive()
