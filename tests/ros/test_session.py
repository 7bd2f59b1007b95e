"""The command line as a node: what others say on the wire does not end its waiting."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message

from irlpilco_ros.ros.learner_progress import (
    STATUS_NAME,
    LearnerProgress,
    MalformedProgressError,
)
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import DIAGNOSTICS
from irlpilco_ros.ros.session import Session

MINIMAL = str(Path(__file__).with_name("minimal_node.py"))
LATER = time_message(2**31 * 10**9 - 1)
GOOD = LearnerProgress("trial", 3, 0.5, 1.25, 7, 2.0)


def altered(**values: str | None) -> DiagnosticArray:
    """Return a message of progress with other values, those that are None left out."""
    message = GOOD.to_message(LATER)
    told = {item.key: item.value for item in message.status[0].values} | values
    pairs = [KeyValue(key=key, value=value) for key, value in told.items() if value is not None]
    status = DiagnosticStatus(level=DiagnosticStatus.OK, name=STATUS_NAME, values=pairs)
    array = DiagnosticArray(status=[status])
    array.header.stamp = LATER
    return array


MALFORMED = [
    altered(stage=None),
    altered(seconds_left=None),
    altered(iteration="three"),
    altered(iteration="1e3"),
    altered(cost=""),
    altered(fraction="nan"),
    altered(fraction="-1e308"),
    altered(stage="\x1b[2J"),
]


def test_progress_comes_back_as_it_was_told():
    assert LearnerProgress.from_message(GOOD.to_message(LATER)) == GOOD
    assert LearnerProgress.from_message(DiagnosticArray()) is None


@pytest.mark.parametrize("message", MALFORMED)
def test_what_no_learner_says_is_refused(message):
    with pytest.raises(MalformedProgressError, match="a learner's progress cannot be made of"):
        LearnerProgress.from_message(message)


@pytest.mark.dds
def test_what_no_learner_says_does_not_end_the_waiting_for_it(ros, monkeypatch):
    ros.run([sys.executable, MINIMAL])
    ros.wait_for_node("minimal")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    with Session("caller") as caller:
        publisher = ros.publisher(DiagnosticArray, "learner/progress", DIAGNOSTICS, subscribers=1)
        whole = serialize_message(GOOD.to_message(LATER))
        before_epoch = GOOD.to_message(Time(sec=-5))
        payloads = [whole[:length] for length in range(4, 60, 7)]
        payloads += [whole[:20] + b"\xff\xff\xff\x7f" + whole[24:], serialize_message(before_epoch)]
        payloads += [serialize_message(message) for message in MALFORMED]
        said = iter([*payloads, GOOD.to_message(LATER)])

        def disturb() -> None:
            message = next(said, None)
            if message is not None:
                publisher.publish(message)

        for _ in range(5):
            caller.trigger("minimal/dawdle", 30.0, on_wait=disturb)
            if caller.progress is not None:
                break
            said = iter([GOOD.to_message(LATER)])
        assert caller.progress == GOOD
