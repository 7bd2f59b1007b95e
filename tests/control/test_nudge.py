"""A nudge tells gain, delay, crossed joints, false velocities and a missing time-out."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from robot_of_two import JOINTS, ROBOT, nanoseconds

from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.control.nudge import WAY, Nudge

STEP = 0.01
NOISE = 4e-4


class Servo:
    """Two joints that do what they are told, or not."""

    def __init__(self, *, gain=1.0, delay=0.05, timeout=0.2, order=(0, 1), speeds=1.0):
        self.gain, self.delay, self.timeout, self.order = gain, delay, timeout, order
        self.speeds = speeds
        self.positions = np.array([0.5, -0.5])
        self.heard: list[tuple[float, np.ndarray]] = [(-1.0, np.zeros(2))]
        self.rng = np.random.default_rng(0)

    def nudged(self, robot=ROBOT, tries_timeout=True):
        nudge, k = Nudge(robot, tries_timeout), 0
        while True:
            time, speed = k * STEP, self.velocity(k * STEP)
            noisy = self.positions + NOISE * self.rng.standard_normal(2)
            told = self.speeds * speed + 0.005 * self.rng.standard_normal(2)
            command = nudge.command(JointReading(nanoseconds(time), noisy, told))
            if command.done:
                return nudge
            if not nudge.withheld:
                self.heard.append((time, command.values))
            self.positions = self.positions + STEP * self.velocity(time)
            k += 1

    def velocity(self, now):
        time, values = next(each for each in reversed(self.heard) if each[0] <= now - self.delay)
        if now - self.delay - time > self.timeout:
            return np.zeros(2)
        return self.gain * values[list(self.order)]


def told(servo, **options):
    return [(each.is_right, each.text) for each in servo.nudged(**options).findings(0.6)]


@pytest.mark.parametrize(("gain", "delay"), [(1.0, 0.0), (0.6, 0.1), (1.2, 0.4)])
def test_gain_and_delay_are_those_of_the_servo(gain, delay):
    nudge = Servo(gain=gain, delay=delay).nudged()
    for number in range(2):
        seen = nudge._seen(number)
        assert seen.gain == pytest.approx(gain, abs=0.04)
        assert seen.late == pytest.approx(delay + STEP, abs=0.02)


def test_a_sound_robot_is_right_and_stands_near_where_it_stood():
    servo = Servo()
    found = told(servo)
    assert [right for right, _ in found] == [True] * 3
    assert found[0][1].startswith("elbow: makes ")
    assert "time-out: elbow stops 0.2 s after" in found[2][1]
    np.testing.assert_allclose(servo.positions, [0.5, -0.5], atol=1.1 * WAY)


def test_it_goes_towards_the_middle():
    nudge = Servo().nudged(tries_timeout=False)
    assert nudge._seen(0).wanted == pytest.approx(-WAY)
    assert nudge._seen(1).wanted == pytest.approx(WAY)


@pytest.mark.parametrize(
    ("servo", "reason"),
    [
        (Servo(order=(1, 0)), r"elbow: when it was commanded -0\.010 rad, wrist went -0\.010"),
        (Servo(gain=0.0), r"commanded -0\.010 rad, it went .*does it hear joint_command"),
        (Servo(gain=-1.0), r"commanded -0\.010 rad, it went \+0\.0"),
        (Servo(delay=0.8), "set approach_delay above it"),
        (Servo(speeds=0.0), r"its velocities add up to .0\.00"),
        (Servo(speeds=-1.0), r"its velocities add up to \+0\.0"),
        (Servo(timeout=np.inf), "time-out: elbow goes on for 1 s without a command"),
    ],
)
def test_what_is_wrong_is_said(servo, reason):
    wrong = [text for right, text in told(servo) if not right]
    assert len(wrong) >= 1
    assert any(re.search(reason, text) for text in wrong), wrong


def test_a_gripper_is_nudged_by_less_and_a_joint_held_still_not_at_all():
    gripper = dataclasses.replace(ROBOT, position_lower=(0.49, -1.0), position_upper=(0.53, 1.0))
    assert abs(Servo().nudged(gripper)._seen(0).wanted) == pytest.approx(0.04 * WAY)
    still = dataclasses.replace(ROBOT, velocity_limit=(0.0, 2.0))
    found = told(Servo(), robot=still)
    assert found[0][1] == "elbow: not nudged, velocity_limit 0 holds it still"
    assert [right for right, _ in found] == [True] * 3
    assert "wrist stops" in found[2][1]


def test_one_joint_alone_can_be_nudged():
    assert JOINTS[0] == "elbow"
    one = dataclasses.replace(ROBOT, unactuated_joints=("wrist",))

    class One(Servo):
        def velocity(self, now):
            time, values = next(e for e in reversed(self.heard) if e[0] <= now - self.delay)
            held = now - self.delay - time > self.timeout
            return np.zeros(2) if held else np.array([float(np.atleast_1d(values)[0]), 0.0])

    assert [right for right, _ in told(One(), robot=one)] == [True, True]
