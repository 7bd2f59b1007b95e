"""/diagnostics: at 1 Hz even without /clock, and at once when something changes."""

from __future__ import annotations

import sys
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
    ros.wait_for(lambda: len(heard.messages) >= 3, "three reports")
    np.testing.assert_allclose(np.diff(heard.arrivals)[1:], 1.0, atol=0.3)
    status = heard.messages[-1].status[0]
    assert status.name == "robot/minimal"
    assert (status.level, status.message) == (DiagnosticStatus.OK, "ready")
    assert [(pair.key, pair.value) for pair in status.values] == [("answer", "42")]

    heard.clear()
    ros.trigger("/robot/minimal/warn")
    ros.wait_for(lambda: heard.messages, "the change", timeout=0.3)
    status = heard.messages[0].status[0]
    assert (status.level, status.message) == (DiagnosticStatus.WARN, "getting warm")
