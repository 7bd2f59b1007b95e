"""Where the page is served: a port that was asked for, or the next one that is free."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

from irlpilco_ros.cli import main
from irlpilco_ros.commands.view import DEFAULT_PORT, HOST

pytest.importorskip("viser", reason="viser, which draws the page, is not installed")


@pytest.fixture
def bag(repository):
    return str(repository / "bags/sweep/demonstration")


def test_a_port_that_was_asked_for_and_is_taken_is_refused(capsys, bag):
    with socket.create_server((HOST, 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["view", bag, "--no-browser", "--port", port]) == 1
    error = capsys.readouterr().err
    assert f"port {port} cannot be used: Address already in use" in error
    assert error.count("\n") == 1


def test_where_the_default_port_is_taken_it_says_which_one_is_used(bag):
    try:
        taken = socket.create_server((HOST, DEFAULT_PORT))
    except OSError:  # by somebody else: as well
        taken = socket.socket()
    command = [sys.executable, "-m", "irlpilco_ros.cli", "view", bag, "--no-browser"]
    with taken, subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        line = next(line for line in process.stdout if "http://localhost" in line)
        address = re.search(rf"(http\S+) \(port {DEFAULT_PORT} is taken; Ctrl-C ends it\)", line)
        assert address is not None, line
        with urllib.request.urlopen(address[1], timeout=60.0) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 0
