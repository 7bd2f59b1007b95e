"""/diagnostics: at 1 Hz even without /clock, and at once when something changes."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

pytestmark = pytest.mark.dds
MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


def test_health_comes_at_1_hz_on_a_steady_clock_and_at_once_on_a_change(ros):
    arguments = ["-p", "use_sim_time:=true", "-r", "__ns:=/robot"]
    ros.run([sys.executable, MINIMAL, "--ros-args", *arguments])
    heard = ros.listen(DiagnosticArray, "/diagnostics", publishers=1)
    ros.wait_for(lambda: len(heard.messages) >= 8, "eight reports")
    # What a busy computer makes longer, it makes shorter next, and one it may hold up for long.
    assert 0.7 < np.median(np.diff(heard.arrivals)[1:]) < 2.0
    status = heard.messages[-1].status[0]
    assert status.name == "robot/minimal"
    assert (status.level, status.message) == (DiagnosticStatus.OK, "ready")
    assert [(pair.key, pair.value) for pair in status.values] == [("answer", "42")]

    def warnings():
        statuses = [status for message in heard.messages for status in message.status]
        return [each.message for each in statuses if each.level == DiagnosticStatus.WARN]

    heard.clear()
    taken = []
    for number in range(20):
        ros.trigger("/robot/minimal/warn")
        began = time.monotonic()
        ros.wait_for(lambda last=number: len(set(warnings())) > last, "the change")
        taken.append(time.monotonic() - began)
    assert np.median(taken) < 0.25, "a change is told at once, not when its second is over"
    assert warnings()[0] == "getting warm (1)"
