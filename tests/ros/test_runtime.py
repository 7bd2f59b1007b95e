"""Nodes start, tell of bad settings in one line, and end in good order."""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path

import pytest
from std_msgs.msg import String

pytestmark = pytest.mark.dds
MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


def start_minimal(ros, *arguments):
    process = ros.run([sys.executable, MINIMAL, "--ros-args", *arguments])
    ros.wait_for_node("minimal", process)
    return process


def listen_to_last_words(ros):
    words = ros.listen(String, "last_words")
    ros.wait_for(lambda: ros.trigger("minimal/is_heard").success, "the node to know its listener")
    return words


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_after_its_last_message(ros, number):
    process = start_minimal(ros)
    words = listen_to_last_words(ros)
    began = time.monotonic()
    assert process.stop(number) == 0
    assert time.monotonic() - began < 3.0
    ros.wait_for(lambda: words.messages, "the last words")
    assert [message.data for message in words.messages] == ["farewell"]


def test_a_failing_callback_ends_the_node_with_1_but_still_in_good_order(ros):
    process = start_minimal(ros)
    process.expected_code = 1
    words = listen_to_last_words(ros)
    ros.trigger_async("minimal/fail")
    assert process.wait() == 1
    ros.wait_for(lambda: words.messages, "the last words")
    assert "a fault in a callback" in process.output


def test_a_bad_setting_at_the_start_is_one_line_on_stderr(ros):
    process = ros.run([sys.executable, MINIMAL, "--ros-args", "-p", "mode:=loud"])
    process.expected_code = 1
    assert process.wait() == 1
    assert process.output.strip() == (
        "error: MinimalSettings.mode is 'loud'; valid values: slow, fast"
    )
