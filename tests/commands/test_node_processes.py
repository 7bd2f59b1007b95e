"""Groups of processes: started, missed when they die, stopped together."""

from __future__ import annotations

import os
import signal
import time

import pytest

from irlpilco_ros.commands import node_processes
from irlpilco_ros.commands.node_processes import NodeDiedError, NodeProcesses

# Naps, not one long sleep: a signal right before that would be taken only after it.
PATIENT = """
import signal, time
def main():
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        print("ready", flush=True)
        for _ in range(6000):
            time.sleep(0.01)
    except KeyboardInterrupt:
        return 0
"""
IMPORTING = "import time\nprint('ready', flush=True)\ntime.sleep(60)\n"
FAILING = "import sys\nprint('cannot find the arm')\nsys.exit(3)\n"
STUBBORN = (
    "import signal, time\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    "print('ready', flush=True)\ntime.sleep(60)\n"
)


@pytest.fixture
def start(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    with NodeProcesses(tmp_path / "log", environment) as nodes:

        def begin(name, source):
            (tmp_path / f"{name}.py").write_text(source)
            return nodes.start(name, name)

        yield nodes, begin


def wait_for_line(node, line):
    deadline = time.monotonic() + 60.0
    while line not in node.log.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_all_are_stopped_in_good_order(start):
    nodes, begin = start
    running = [begin("first", PATIENT), begin("second", PATIENT)]
    for node in running:
        wait_for_line(node, "ready")
    nodes.check()
    assert nodes.stop() == []
    assert all(node.process.returncode == 0 for node in running)


def test_one_that_is_stopped_while_it_still_imports_is_no_complaint(start):
    nodes, begin = start
    node = begin("early", IMPORTING)
    wait_for_line(node, "ready")
    assert nodes.stop() == []
    assert node.last_lines() == "    ready", "no traceback"


def test_each_is_in_a_process_group_of_its_own(start):
    _, begin = start
    node = begin("own", PATIENT)
    assert os.getpgid(node.process.pid) == node.process.pid != os.getpgrp()


def test_a_death_is_told_with_name_code_and_log(start):
    nodes, begin = start
    node = begin("camera", FAILING)
    node.process.wait(60.0)
    with pytest.raises(
        NodeDiedError, match=r"camera ended with exit code 3[^$]*cannot find the arm"
    ):
        nodes.check()


def test_a_kill_is_told_by_the_signals_name(start):
    nodes, begin = start
    node = begin("victim", PATIENT)
    os.killpg(node.process.pid, signal.SIGKILL)
    node.process.wait(60.0)
    with pytest.raises(NodeDiedError, match="victim ended with signal SIGKILL"):
        nodes.check()


def test_one_that_does_not_stop_is_killed(start, monkeypatch):
    monkeypatch.setattr(node_processes, "STOP_TIMEOUT", 0.3)
    nodes, begin = start
    node = begin("stubborn", STUBBORN)
    wait_for_line(node, "ready")
    assert nodes.stop() == ["stubborn did not stop within 0 s: killed"]
    assert node.process.returncode == -signal.SIGKILL
