"""Simulated time against the wall clock."""

from __future__ import annotations

import threading
import time

import pytest

from sim_bridge.pacemaker import Pacemaker


def test_beats_take_their_wall_time_on_average() -> None:
    pacemaker = Pacemaker(0.01, 2.0, threading.Event())
    started = time.monotonic()
    for beat in range(40):
        if beat == 10:
            time.sleep(0.05)  # a delay that can be caught up
        pacemaker.wait()
    assert time.monotonic() - started == pytest.approx(0.2, abs=0.1)
    assert pacemaker.seconds_lost == 0.0


def test_a_long_delay_is_given_up_and_counted() -> None:
    pacemaker = Pacemaker(0.01, 1.0, threading.Event())
    time.sleep(0.4)
    pacemaker.wait()
    assert pacemaker.seconds_lost == pytest.approx(0.39, abs=0.1)
    started = time.monotonic()
    pacemaker.wait()
    assert time.monotonic() - started == pytest.approx(0.01, abs=0.05)


def test_as_fast_as_it_goes_never_waits() -> None:
    pacemaker = Pacemaker(0.01, 0.0, threading.Event())
    started = time.monotonic()
    for _ in range(100):
        pacemaker.wait()
    assert time.monotonic() - started < 0.2


def test_stop_ends_a_wait() -> None:
    stop = threading.Event()
    pacemaker = Pacemaker(30.0, 1.0, stop)
    threading.Timer(0.05, stop.set).start()
    started = time.monotonic()
    pacemaker.wait()
    assert time.monotonic() - started < 2.0
