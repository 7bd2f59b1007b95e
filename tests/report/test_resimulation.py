"""The processes that simulate for a report."""

from __future__ import annotations

import os
import signal

from irlpilco_ros.report.resimulation import workers


def test_ctrl_c_is_the_parents_alone():
    """A terminal sends it to all; a worker that is still importing would print a traceback."""
    with workers() as pool:
        blocked = pool.submit(signal.pthread_sigmask, signal.SIG_BLOCK, ()).result()
        assert pool.submit(os.getpid).result() != os.getpid()
    assert signal.SIGINT in blocked
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
