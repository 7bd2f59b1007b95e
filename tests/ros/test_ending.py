"""A process is ended by a signal whatever its main thread is at."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from irlpilco_ros.ros.ending import Ending

BESIEGED = """
import random, signal, time
from irlpilco_ros.ros import ending as module

module._SIGNALS = (signal.SIGALRM,)  # the one that comes to the microsecond
ending = module.Ending()
ending.take_signals()
count, end = 0, time.monotonic() + 2.0
while time.monotonic() < end:
    signal.setitimer(signal.ITIMER_REAL, random.uniform(1e-6, 1e-4))
    ending.wait()
    count += 1
print(count)
"""

WAITING = """
import signal
from irlpilco_ros.ros.ending import Ending

ending = Ending()
ending.take_signals()
signal.signal(signal.SIGUSR1, lambda *_: None)
print("waiting", flush=True)
ending.wait()
"""


def test_no_signal_finds_the_main_thread_where_it_cannot_be_ended():
    """Of thousands at all its steps, each ends a wait; one that could not would be the last."""
    command = [sys.executable, "-c", BESIEGED]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30.0, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_these_signals_end_a_wait_and_no_other_does(number):
    command = [sys.executable, "-c", WAITING]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "waiting\n"
    os.kill(process.pid, signal.SIGUSR1)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.3)
    os.kill(process.pid, number)
    assert process.wait(30.0) == 0


def test_a_thread_that_asks_ends_the_wait_at_once_and_so_does_who_asked_before():
    ending = Ending()
    ending.ask()
    ending.wait()
    threading.Timer(0.1, ending.ask).start()
    began = time.monotonic()
    ending.wait()
    assert 0.05 < time.monotonic() - began < 10.0
