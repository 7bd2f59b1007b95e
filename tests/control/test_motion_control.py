"""One motion at a time, every stamp answered once, and silence that is real."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from robot_of_two import JOINTS, ROBOT, nanoseconds, sample

from irlpilco_ros.control.controller_settings import GUARDS, ControllerSettings
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


def watch_until_stopped(control, outcomes, begin, until, message=None):
    """Watch every 10 ms, a message coming each time; return when the motion ended [s]."""
    for step in range(round((until - begin) / 0.01)):
        now = begin + 0.01 * step
        if message is not None:
            control.take(message(now), now)
        control.watch(now)
        if outcomes:
            return now
    return None


def test_silence_stops_the_robot(control, outcomes):
    begin(control, outcomes)
    control.take(sample(0.01), now=10.0)
    assert 10.119 < watch_until_stopped(control, outcomes, 10.0, 11.0) < 10.141
    assert "no joint state for 0.12 s of: elbow, wrist" in outcomes[0].message


def test_a_hold_up_of_this_process_is_no_silence(control, outcomes):
    begin(control, outcomes)
    control.take(sample(0.01), now=10.0)
    assert control.watch(now=10.0) is None
    assert control.watch(now=10.19) is None, "there may be states on their way"
    control.take(sample(0.02), now=10.195)
    assert control.watch(now=10.2) is None
    assert outcomes == []


@pytest.mark.parametrize(
    "stamp",
    [
        lambda elapsed: 0.0,
        lambda elapsed: 7.0,
        lambda elapsed: 7.0 - elapsed % 0.05,  # back by little, over and over
        lambda elapsed: 7.0 - elapsed,
    ],
)
def test_stamps_that_do_not_advance_stop_the_robot(control, outcomes, stamp):
    control.take(sample(stamp(0.0)), now=10.0)
    control.start(Trial(Constant(0.1, 0.2), 100, 0.1), 10.0, outcomes.append)
    end = watch_until_stopped(
        control, outcomes, 10.0, 12.0, lambda now: sample(stamp(max(0.0, now - 10.0)))
    )
    assert 10.119 < end < 10.141
    assert "joint-state stamps do not advance: messages come, but" in outcomes[0].message
    # The next motion is refused for the same reason.
    for step in range(20):
        control.take(sample(stamp(0.2)), end + 0.01 * step)
    with pytest.raises(MotionRefusedError, match="stamps do not advance"):
        control.start(Trial(Constant(0.1, 0.2), 100, 0.1), end + 0.2, outcomes.append)


def test_a_waiting_simulator_may_repeat_a_state_but_not_for_ever(control, outcomes):
    begin(control, outcomes)
    control.note_clock(10_000_000)
    end = watch_until_stopped(control, outcomes, 10.0, 20.0, lambda now: sample(0.01))
    assert 15.0 < end < 15.03
    assert "for 5 s none later than 0.010 s" in outcomes[0].message


def test_a_waiting_simulator_is_known_even_if_some_of_its_clock_was_lost(control, outcomes):
    begin(control, outcomes)
    control.note_clock(10_000_000)
    control.take(sample(0.08), now=10.01)
    end = watch_until_stopped(control, outcomes, 10.01, 20.0, lambda now: sample(0.08))
    assert end > 15.0


def test_between_motions_a_simulator_may_wait_as_long_as_it_likes(control, outcomes):
    for now in range(10, 1000, 2):
        control.take(sample(0.01), now)
        control.note_clock(10_000_000)
    control.start(Trial(Constant(0.1, 0.2), 100, 0.1), 1000.0, outcomes.append)
    end = watch_until_stopped(control, outcomes, 1000.0, 1010.0, lambda now: sample(0.01))
    assert 1005.0 < end < 1005.03


def test_a_clock_that_goes_on_is_no_excuse(control, outcomes):
    begin(control, outcomes)

    def message(now):
        control.note_clock(nanoseconds(now - 9.99))
        return sample(0.01)

    assert watch_until_stopped(control, outcomes, 10.0, 20.0, message) < 10.16


def test_a_clock_of_another_time_is_no_excuse(control, outcomes):
    control.take(sample(5.0), now=10.0)
    control.start(Trial(Constant(0.1, 0.2), 100, 0.1), 10.0, outcomes.append)
    control.note_clock(nanoseconds(4.5))
    assert watch_until_stopped(control, outcomes, 10.0, 20.0, lambda now: sample(5.0)) < 10.16


def test_in_lockstep_a_missing_joint_is_counted_in_simulated_time(control, outcomes):
    begin(control, outcomes)
    for step in range(20):
        time, now = 0.01 * step, 10.0 + 0.001 * step
        control.note_clock(nanoseconds(time))
        names = JOINTS if step < 3 else JOINTS[:1]
        zeros = (0.0,) * len(names)
        control.take(JointStateMessage(nanoseconds(time), names, zeros, zeros), now)
        control.watch(now)
    assert "no joint state for 0.12 s of: wrist" in outcomes[0].message


def test_a_controller_that_was_away_does_not_jerk_on(control, outcomes):
    begin(control, outcomes)
    assert control.take(sample(0.01), now=10.01).values.any()
    assert control.take(sample(0.2), now=10.2).values.any()
    command = control.take(sample(0.42), now=10.42)  # stopped for longer than 0.2 s
    assert command.values.tolist() == [0.0, 0.0]
    assert "no command went out for 0.220 s" in outcomes[0].message
    assert "held up?" in outcomes[0].message


def test_in_lockstep_no_time_passes_while_the_controller_is_away(control, outcomes):
    begin(control, outcomes)
    for step in range(1, 4):
        control.note_clock(nanoseconds(0.01 * step))
        assert control.take(sample(0.01 * step), now=10.0 + step).values.any()
    assert outcomes == []


def test_positions_are_checked_on_every_message(control, outcomes):
    begin(control, outcomes, 0.0, 0.0)
    assert control.take(sample(0.01), now=10.0) is not None
    assert control.take(sample(0.01, (0.0, -1.01)), now=10.0).values.tolist() == [0.0, 0.0]
    assert "joint wrist is at -1.0100 rad, beyond its lower limit -1 rad" in outcomes[0].message
    with pytest.raises(MotionRefusedError, match="beyond its lower limit"):
        control.start(Trial(Constant(0.1, 0.1), 1, 0.1), 10.0, outcomes.append)


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
    control.take(JointStateMessage(2, ("elbow", "wrist"), (0.0, 0.0), ()), now=10.0)
    assert refusal().startswith("no joint state yet of: wrist; joint state has 2 names, 2 pos")
    control.take(sample(0.01, positions=(0.0, np.nan)), now=10.0)
    assert "position of joint wrist is nan" in refusal()
    control.take(sample(0.02), now=10.0)
    assert refusal(now=10.2) == "no joint state for 0.12 s of: elbow, wrist"
    control.change(dataclasses.replace(control.settings, enabled=False))
    assert "disabled" in refusal()
    control.change(dataclasses.replace(control.settings, enabled=True))
    control.start(trial, 10.0, outcomes.append)
    assert "busy: trial is going on" in refusal()
    assert outcomes == []


@pytest.mark.parametrize("guard", GUARDS)
def test_a_change_of_what_guards_a_motion_ends_it(control, outcomes, guard):
    begin(control, outcomes)
    control.take(sample(0.01), now=10.0)
    before = getattr(control.settings, guard)
    command = control.change(dataclasses.replace(control.settings, **{guard: 0.5}))
    assert command.values.tolist() == [0.0, 0.0]
    assert f"changed under way: {guard} from {before:g} to 0.5" in outcomes[0].message


def test_other_settings_can_change_while_it_moves(control, outcomes):
    begin(control, outcomes)
    assert control.change(dataclasses.replace(control.settings, approach_speed=0.2)) is None
    assert control.take(sample(0.01), now=10.0).values.any()
    assert outcomes == []


def test_disabling_ends_a_motion_and_sends_zero_in_any_case(control, outcomes):
    begin(control, outcomes)
    disabled = dataclasses.replace(control.settings, enabled=False)
    assert control.change(disabled).values.tolist() == [0.0, 0.0]
    assert "the controller was disabled" in outcomes[0].message
    control.change(dataclasses.replace(disabled, enabled=True))
    assert control.change(disabled).values.tolist() == [0.0, 0.0]


def test_a_trial_begins_at_the_start_of_its_policy(control):
    control.check_start()  # nothing is known
    control.change(dataclasses.replace(control.settings, start_position=(0.1, 0.2)))
    control.check_start()  # the readings are still missing
    control.take(sample(0.0, positions=(0.05, 0.2)), now=10.0)
    control.check_start()
    control.take(sample(0.1, positions=(0.1, 0.31)), now=10.0)
    with pytest.raises(MotionRefusedError, match=r"wrist is 0\.1100 rad from the policy's start"):
        control.check_start()
    spread = MotionControl(dataclasses.replace(ROBOT, start_spread=0.02), control.settings)
    spread.take(sample(0.1, positions=(0.1, 0.31)), now=10.0)
    spread.check_start()


def test_busy_is_the_reason_during_a_trial_wherever_the_robot_is(control, outcomes):
    begin(control, outcomes)
    far = dataclasses.replace(control.settings, start_position=(1.0, 0.2))
    control.change(far)
    control.check_start()
    with pytest.raises(MotionRefusedError, match=r"busy: .* is going on"):
        control.start(Trial(Constant(0.0, 0.0), 10, 0.1), 0.0, outcomes.append)
    control.stop("enough")
    with pytest.raises(MotionRefusedError, match="from the policy's start"):
        control.check_start()


def push(control, outcomes, positions, values=(0.4, 0.0), seconds=5.0):
    """Command constant values while the joints are at positions(time); return when it ended."""
    control.take(sample(0.0, positions(0.0)), now=0.0)
    control.start(Trial(Constant(*values), 1000, 0.1), 0.0, outcomes.append)
    for step in range(1, round(seconds / 0.01)):
        time = 0.01 * step
        control.take(sample(time, positions(time)), now=time)
        if outcomes:
            return time
    return None


def test_a_joint_that_is_commanded_but_does_not_move_stops_the_robot(control, outcomes):
    def blocked(time):
        return (min(0.4 * time, 0.5), 0.0)  # something is in its way after 1.25 s

    assert 2.25 < push(control, outcomes, blocked) <= 3.26, "at most twice stall_timeout"
    message = "joint elbow is commanded but does not move: in 1 s it was to go 0.40"
    assert message in outcomes[0].message


def test_slow_late_and_weak_joints_are_not_taken_for_blocked(control, outcomes):
    assert (
        push(control, outcomes, lambda time: (0.4 * max(0.0, time - 0.6), 0.0), seconds=2.5) is None
    )
    control.stop("")
    outcomes.clear()
    assert push(control, outcomes, lambda _: (0.0, 0.0), values=(0.09, -0.09)) is None


def test_a_robot_that_runs_behind_a_command_to_and_fro_is_moving(control, outcomes):
    class ToAndFro:
        def act(self, _state, step):
            return np.array([0.5 if step // 12 % 2 else -0.5, 0.0])

    def late(time):  # by half a second: back where it was after one
        phase = (time - 0.5) % 2.4
        return (0.5 * abs(phase - 1.2), 0.0)

    control.take(sample(0.0, late(0.0)), now=0.0)
    control.start(Trial(ToAndFro(), 1000, 0.1), 0.0, outcomes.append)
    for step in range(1, 1000):
        control.take(sample(0.01 * step, late(0.01 * step)), now=0.01 * step)
    assert outcomes == []


def test_in_simulation_a_trial_may_push_against_its_stops(outcomes):
    control = MotionControl(ROBOT, ControllerSettings(position_margin=-0.5))
    assert push(control, outcomes, lambda _: (1.0, 0.0)) is None


def test_an_effort_beyond_its_limit_stops_the_robot(control, outcomes):
    begin(control, outcomes)
    still = (0.0, 0.0)
    fair = JointStateMessage(nanoseconds(0.01), JOINTS, still, still, (4.9, -2.9))
    assert control.take(fair, now=10.0).values.any()
    untold = JointStateMessage(nanoseconds(0.02), JOINTS, still, still, (9.0,))
    assert control.take(untold, now=10.0).values.any()
    high = JointStateMessage(nanoseconds(0.02), JOINTS, still, still, (0.0, -3.2))
    assert control.take(high, now=10.0).values.tolist() == [0.0, 0.0]
    assert "effort of joint wrist is -3.20 Nm; its effort limit is 3 Nm" in outcomes[0].message


def test_the_last_command_is_there_to_be_repeated_while_a_motion_goes_on(control, outcomes):
    begin(control, outcomes, horizon=1)
    assert control.last is None
    command = control.take(sample(0.01), now=10.0)
    assert control.last is command
    control.take(sample(0.2), now=10.1)
    assert outcomes[0].succeeded
    assert control.last is None
