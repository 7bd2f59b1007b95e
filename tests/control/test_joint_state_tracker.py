"""Merging joint states by name, however they come."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.control.joint_state_tracker import JointStateTracker, MalformedJointStateError
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage

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


def test_a_repeated_stamp_is_fresh_but_not_new():
    tracker = JointStateTracker(("elbow",))
    assert tracker.update(sample(1, elbow=1.0), arrival=0.0)
    assert not tracker.update(sample(1, elbow=1.0), arrival=1.0)
    assert tracker.silent(now=1.1, timeout=0.15) == ()
    assert tracker.update(sample(0, elbow=1.0), arrival=1.2), "a clock set back is a new state"


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
