"""Nodes start, tell of bad settings in one line, and end in good order."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from std_msgs.msg import String

pytestmark = pytest.mark.dds
SECURE = {
    "ROS_SECURITY_ENABLE": "true",
    "ROS_SECURITY_STRATEGY": "Enforce",
    "ROS_SECURITY_KEYSTORE": "/nowhere",
}
KEY_FILES = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
)
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
    assert time.monotonic() - began < 10.0
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


STUCK = """
import sys
from irlpilco_ros.ros import runtime
from minimal_node import MinimalNode

class Stuck(MinimalNode):
    def destroy_node(self):
        sys.setswitchinterval(1e6)  # no other thread of Python gets a turn
        while True:
            pass

runtime.LEAVING = 1.0
sys.exit(runtime.run_node(Stuck))
"""


def test_a_middleware_that_does_not_let_go_does_not_keep_the_process(ros):
    ros.environment["PYTHONPATH"] += os.pathsep + str(Path(MINIMAL).parent)
    process = ros.run([sys.executable, "-c", STUCK])
    process.expected_code = 1
    ros.wait_for_node("minimal", process)
    words = listen_to_last_words(ros)
    assert process.stop() == 1
    assert "in destroy_node" in process.output
    ros.wait_for(lambda: words.messages, "the last words, all the same")


def test_a_bad_setting_at_the_start_is_one_line_on_stderr(ros):
    process = ros.run([sys.executable, MINIMAL, "--ros-args", "-p", "mode:=loud"])
    process.expected_code = 1
    assert process.wait() == 1
    assert process.output.strip() == (
        "error: MinimalSettings.mode is 'loud'; valid values: slow, fast"
    )


@pytest.mark.parametrize(
    ("arguments", "environment", "said"),
    [
        (["--params-file", "nowhere.yaml"], {}, "nowhere.yaml"),
        (["-r", "nothing"], {}, "remap rule"),
        (["-p", "gain"], {}, "parameter override"),
        ([], {"ROS_DOMAIN_ID": "seven"}, "ROS_DOMAIN_ID is not an integral number"),
        ([], SECURE, "SECURITY ERROR"),
    ],
)
def test_what_ros_itself_refuses_is_a_sentence(ros, arguments, environment, said):
    ros.environment |= environment
    process = ros.run([sys.executable, MINIMAL, "--ros-args", *arguments])
    process.expected_code = 1
    assert process.wait() == 1
    line = process.output.splitlines()[-1]
    assert line.startswith("error: ROS 2 does not start: ")
    assert said in line
    assert ".c:" not in line
    assert "Traceback" not in process.output


def test_a_middleware_that_cannot_use_the_keys_is_a_sentence(ros, tmp_path):
    """The wheels' Fast DDS has no security; another finds that these keys are none."""
    enclave = tmp_path / "keys/enclaves"
    enclave.mkdir(parents=True)
    for name in KEY_FILES:
        (enclave / name).touch()
    ros.environment |= {**SECURE, "ROS_SECURITY_KEYSTORE": str(enclave.parent)}
    process = ros.run([sys.executable, MINIMAL])
    process.expected_code = 1
    assert process.wait() == 1
    line = process.output.splitlines()[-1]
    assert line.startswith("error: ROS 2 does not start: error creating node: ")
    assert "Traceback" not in process.output
