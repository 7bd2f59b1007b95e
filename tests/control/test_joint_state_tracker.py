"""Merging joint states by name, however they come."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.control.joint_state_tracker import JointStateTracker, MalformedJointStateError
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage

SECOND = 1_000_000_000
JOINTS = ("shoulder", "elbow", "wrist")


def sample(stamp, **joints):
    return JointStateMessage(
        stamp, tuple(joints), tuple(joints.values()), tuple(-q for q in joints.values())
    )


@given(st.permutations(["shoulder", "elbow", "wrist", "head", "gripper"]))
def test_order_and_extra_joints_do_not_matter(order):
    values = {"shoulder": 1.0, "elbow": 2.0, "wrist": 3.0, "head": 8.0, "gripper": 9.0}
    tracker = JointStateTracker(JOINTS)
    assert tracker.update(sample(5, **{name: values[name] for name in order}), arrival=0.0)
    reading = tracker.reading()
    assert reading.stamp == 5
    np.testing.assert_array_equal(reading.state, [1, 2, 3, -1, -2, -3])


def test_partial_messages_are_merged_and_missing_joints_named():
    tracker = JointStateTracker(JOINTS)
    assert tracker.missing() == JOINTS
    tracker.update(sample(1, elbow=2.0), arrival=0.0)
    assert tracker.reading() is None
    assert tracker.missing() == ("shoulder", "wrist")
    tracker.update(sample(2, wrist=3.0, shoulder=1.0), arrival=0.1)
    np.testing.assert_array_equal(tracker.reading().positions, [1, 2, 3])
    assert tracker.reading().stamp == 2


def test_a_message_without_wanted_joints_is_no_new_state_even_if_it_is_malformed():
    tracker = JointStateTracker(JOINTS)
    assert not tracker.update(JointStateMessage(7, ("gripper",), (0.0,), ()), arrival=0.0)
    assert tracker.reading() is None


def test_only_later_stamps_are_progress():
    tracker = JointStateTracker(("elbow",))
    assert tracker.update(sample(SECOND, elbow=1.0), arrival=0.0)
    for stamp in (SECOND, SECOND - 1, SECOND - SECOND // 3):
        assert not tracker.update(sample(stamp, elbow=2.0), arrival=1.0)
        assert tracker.stamp == SECOND
    assert tracker.reading().positions == [2.0], "values are taken from every message"
    assert tracker.silent(now=1.1, timeout=0.15) == ()
    assert tracker.stuck(now=1.1, timeout=0.15) == ("elbow",)
    assert tracker.update(sample(SECOND + 1, elbow=1.0), arrival=1.2)
    assert tracker.stuck(now=1.3, timeout=0.15) == ()


def test_a_clock_set_back_by_much_begins_anew():
    tracker = JointStateTracker(("shoulder", "elbow"))
    tracker.update(sample(3 * SECOND, shoulder=1.0, elbow=1.0), arrival=0.0)
    assert tracker.update(sample(SECOND, elbow=1.0), arrival=0.1)
    assert tracker.ran_back == pytest.approx(2.0)
    assert tracker.stamp == SECOND
    assert tracker.update(sample(SECOND + 1, elbow=1.0), arrival=0.2)
    assert tracker.ran_back == 0.0


def test_a_robot_that_was_started_again_is_taken_for_what_it_is():
    tracker = JointStateTracker(("elbow",))
    tracker.update(sample(SECOND, elbow=1.0), arrival=0.0)
    back = SECOND - SECOND // 5
    assert not tracker.update(sample(back, elbow=1.0), arrival=1.4)
    assert tracker.update(sample(back, elbow=1.0), arrival=1.6)
    assert tracker.stuck(now=1.7, timeout=0.15) == ()
    assert not tracker.update(sample(back, elbow=1.0), arrival=5.0), "a stamp that stands still"


def test_a_publisher_whose_clock_is_behind_makes_progress_of_its_own():
    tracker = JointStateTracker(("shoulder", "elbow"))
    for step in range(20):
        arrival, stamp = 0.01 * step, step * 10_000_000 + 5 * SECOND
        assert tracker.update(sample(stamp, shoulder=1.0), arrival)
        assert not tracker.update(sample(stamp - 2 * SECOND, elbow=1.0), arrival)
        assert tracker.ran_back == 0.0
        assert tracker.stuck(arrival, 0.05) == ()
    assert tracker.behind(6 * SECOND, 2.5) == ("elbow",)


def test_silence_is_counted_for_each_joint():
    tracker = JointStateTracker(("shoulder", "elbow"))
    tracker.update(sample(1, shoulder=1.0, elbow=1.0), arrival=0.0)
    tracker.update(sample(2, shoulder=1.0), arrival=0.1)
    assert tracker.silent(now=0.2, timeout=0.15) == ("elbow",)
    assert tracker.silent(now=0.3, timeout=0.15) == ("shoulder", "elbow")


def test_lists_of_different_length_are_refused():
    tracker = JointStateTracker(("elbow",))
    with pytest.raises(MalformedJointStateError, match="1 names, 1 positions and 0 velocities"):
        tracker.update(JointStateMessage(1, ("elbow",), (0.0,), ()), arrival=0.0)
    assert tracker.reading() is None
