"""One motion at a time, every stamp answered once, and silence that is real."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from robot_of_two import JOINTS, ROBOT, sample

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motion_control import MotionControl, MotionRefusedError
from irlpilco_ros.control.motions import Trial
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage


class Constant:
    def __init__(self, *values):
        self.values = np.array(values)

    def act(self, state, step):
        return self.values


@pytest.fixture
def control():
    return MotionControl(ROBOT, ControllerSettings())


@pytest.fixture
def outcomes():
    return []


def begin(control, outcomes, *values, horizon=100):
    """Bring in a state at 0 s and start a trial."""
    control.take(sample(0.0), now=10.0)
    control.start(Trial(Constant(*values or (0.1, 0.2)), horizon, 0.1), 10.0, outcomes.append)


def test_idle_answers_nothing(control):
    assert control.take(sample(0.0), now=0.0) is None
    assert control.watch(now=100.0) is None
    assert control.stop("whatever") is None


def test_every_stamp_is_answered_once_the_waiting_one_too(control, outcomes):
    begin(control, outcomes)
    # In lockstep the simulation repeats the state that came before the start.
    assert control.take(sample(0.0), now=10.05).stamp == 0
    assert control.take(sample(0.0), now=10.1) is None
    assert control.take(sample(0.01), now=10.2) is not None
    assert control.take(sample(0.01), now=10.3) is None


def test_a_stamp_that_was_answered_is_not_answered_by_the_next_motion(control, outcomes):
    begin(control, outcomes, horizon=1)
    assert control.take(sample(0.0), now=10.0) is not None
    assert control.take(sample(0.1), now=10.1).done
    assert outcomes[0].succeeded
    control.start(Trial(Constant(0.1, 0.1), 1, 0.1), 10.1, outcomes.append)
    assert control.take(sample(0.1), now=10.1) is None
    assert control.take(sample(0.11), now=10.1) is not None


def test_messages_of_other_joints_are_no_states(control, outcomes):
    begin(control, outcomes)
    gripper = JointStateMessage(5_000_000, ("gripper",), (0.0,), (0.0,))
    assert control.take(gripper, now=10.0) is None
    assert outcomes == []


def test_a_command_above_the_velocity_limit_stops_with_zero_instead(control, outcomes):
    begin(control, outcomes, 0.1, 2.5)
    command = control.take(sample(0.01), now=10.0)
    assert command.values.tolist() == [0.0, 0.0]
    assert not outcomes[0].succeeded
    assert "its velocity limit is 2 rad/s" in outcomes[0].message
    assert control.motion is None


def test_silence_must_be_seen_twice(control, outcomes):
    begin(control, outcomes)
    control.take(sample(0.01), now=10.0)
    assert control.watch(now=10.14) is None
    assert control.watch(now=10.3) is None, "this process may have been held up"
    control.take(sample(0.02), now=10.31)
    assert control.watch(now=10.32) is None, "and had states waiting"
    assert control.watch(now=10.47) is None
    assert control.watch(now=10.49).values.tolist() == [0.0, 0.0]
    assert "no joint state for 0.15 s of: elbow, wrist" in outcomes[0].message


def test_a_repeated_state_is_no_silence(control, outcomes):
    begin(control, outcomes)
    for now in np.arange(10.0, 12.0, 0.05):
        control.take(sample(0.01), now)
        assert control.watch(now) is None
    assert outcomes == []


def test_partial_states_are_enough_if_all_joints_keep_coming(control, outcomes):
    begin(control, outcomes)
    for step in range(100):
        stamp, now = step * 5_000_000 + 10_000_000, 10.0 + step * 0.005
        joint = JOINTS[step % 2]
        assert control.take(JointStateMessage(stamp, (joint,), (0.0,), (0.0,)), now) is not None
        assert control.watch(now) is None


def test_reasons_to_refuse(control, outcomes):
    trial = Trial(Constant(0.1, 0.1), 1, 0.1)

    def refusal(now=10.0):
        with pytest.raises(MotionRefusedError) as caught:
            control.start(trial, now, outcomes.append)
        return str(caught.value)

    assert refusal() == "no joint state yet of: elbow, wrist"
    control.take(JointStateMessage(1, ("elbow",), (0.0,), (0.0,)), now=10.0)
    assert refusal() == "no joint state yet of: wrist"
    control.take(sample(0.01, positions=(0.0, np.nan)), now=10.0)
    assert "position of joint wrist is nan" in refusal()
    control.take(sample(0.02), now=10.0)
    assert refusal(now=10.2) == "no joint state for 0.15 s of: elbow, wrist"
    control.enabled = False
    assert "disabled" in refusal()
    control.enabled = True
    control.start(trial, 10.0, outcomes.append)
    assert "busy: trial is going on" in refusal()
    assert outcomes == []


def test_settings_can_change_while_it_moves(control, outcomes):
    begin(control, outcomes, 0.1, 0.1)
    control.take(sample(0.01, (0.9, 0.0)), now=10.0)
    control.settings = dataclasses.replace(control.settings, position_margin=0.2)
    assert control.take(sample(0.02, (0.9, 0.0)), now=10.0).done
    assert "within 0.2 rad of its upper limit" in outcomes[0].message
