"""The way to the start on servos that are late, weak, strong, or drift."""

from __future__ import annotations

import itertools
from collections import deque
from dataclasses import dataclass

import numpy as np
import pytest
from robot_of_two import reading

from irlpilco_ros.control.approach import Approach
from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motions import MotionStoppedError

NAMES = ("shoulder", "elbow", "wrist", "hand")
LIMIT = np.array([1.5, 1.5, 4.0, 4.0])
FAR, NEAR = (1.5, -0.7, 0.3, 0.5), (0.2, 0.1, -0.1, 0.15)
NOISE = 4e-4  # [rad], and ten times that in [rad/s]
STEP = 0.01  # [s]


@dataclass(frozen=True)
class Servo:
    """Velocity = gain x command, `delay` [s] later and behind a lag [s] of first order; a drift."""

    delay: float = 0.0
    lag: float = 0.0
    gain: float = 1.0
    drift: float = 0.0
    blocked: bool = False
    noise: float = NOISE


@dataclass(frozen=True)
class Arrival:
    """How it went: time [s], farthest beyond the goal and off it in the end [rad], commands."""

    time: float
    overshoot: float
    error: float
    commands: np.ndarray


def approach(servo: Servo, start=FAR, seed=0, settings=None) -> Arrival:
    """Go from `start` to zero."""
    random = np.random.default_rng(seed)
    position, velocity = np.array(start, dtype=float), np.zeros(4)
    side, overshoot = -np.sign(position), 0.0
    motion = Approach(NAMES, np.zeros(4), LIMIT, settings or ControllerSettings())
    under_way = deque([np.zeros(4)] * round(servo.delay / STEP))
    share = 1.0 if servo.lag == 0.0 else 1.0 - np.exp(-STEP / servo.lag)
    commands = []
    for step in itertools.count():
        seen = position + servo.noise * random.standard_normal(4)
        speed = velocity + 10.0 * servo.noise * random.standard_normal(4)
        command = motion.command(reading(STEP * step, seen, speed))
        commands.append(command.values)
        if command.done:
            error = float(np.abs(position).max())
            return Arrival(STEP * step, overshoot, error, np.array(commands))
        under_way.append(command.values)
        velocity = velocity + share * (servo.gain * under_way.popleft() - velocity)
        if not servo.blocked:
            position = position + STEP * (velocity + servo.drift)
        overshoot = max(overshoot, float((side * position).max()))
    raise AssertionError("unreachable")


LATE = [(0.0, 0.0), (0.1, 0.0), (0.3, 0.0), (0.5, 0.0), (0.0, 0.1), (0.0, 0.3), (0.1, 0.3)]
GAINS = [0.7, 1.0, 1.3]


@pytest.mark.parametrize("gain", GAINS)
@pytest.mark.parametrize("start", [FAR, NEAR])
def test_a_late_robot_arrives_without_overshoot_and_hardly_later(gain, start):
    sound = approach(Servo(gain=gain), start).time
    for delay, lag in LATE:
        arrival = approach(Servo(delay, lag, gain), start)
        assert arrival.overshoot < 0.005, (delay, lag)
        assert arrival.error < 0.0015, (delay, lag)
        assert arrival.time < 1.5 * sound + 2.0, (delay, lag, sound)


@pytest.mark.parametrize(("delay", "lag"), [(0.3, 0.3), (0.0, 0.5), (0.5, 0.2)])
def test_a_robot_that_is_very_late_arrives_later_but_without_overshoot(delay, lag):
    for gain, start in itertools.product(GAINS, (FAR, NEAR)):
        arrival = approach(Servo(delay, lag, gain), start)
        assert arrival.overshoot < 0.01, (gain, start)
        assert arrival.error < 0.0015, (gain, start)
        assert arrival.time < 40.0, (gain, start)


@pytest.mark.parametrize("drift", [-0.05, 0.005, 0.02, 0.05])
@pytest.mark.parametrize(("delay", "lag"), [(0.0, 0.0), (0.3, 0.0), (0.5, 0.0), (0.1, 0.3)])
def test_a_robot_that_drifts_is_held_at_the_start(drift, delay, lag):
    for gain in GAINS:
        arrival = approach(Servo(delay, lag, gain, drift), FAR)
        assert arrival.overshoot < 0.02, gain
        assert arrival.error < 0.002, gain
        assert arrival.time < 40.0, gain


def test_the_way_is_straight_smooth_and_within_its_speed():
    commands = approach(Servo(noise=0.0), settings=ControllerSettings(approach_speed=0.5)).commands
    assert 0.45 < np.abs(commands).max() <= 0.5 + 1e-12
    assert np.abs(np.diff(commands, axis=0)).max() <= 0.01 * 2.0 + 1e-9
    moving = np.abs(commands[:, 0]) > 0.1
    np.testing.assert_allclose(commands[moving, 1] / commands[moving, 0], -0.7 / 1.5, rtol=0.02)
    assert not commands[-1].any()


def test_a_robot_that_stands_at_its_start_is_not_moved():
    arrival = approach(Servo(), (5e-4, -5e-4, 0.0, 0.0))
    assert arrival.time < 1.0
    assert not arrival.commands.any()


def test_a_robot_that_is_blocked_is_told_after_a_few_tries():
    with pytest.raises(MotionStoppedError, match=r"comes no nearer to the start: shoulder is far"):
        approach(Servo(blocked=True), (0.3, 0.0, 0.0, 0.0))
    with pytest.raises(MotionStoppedError, match=r"-0\.[23]\d* rad away, tolerance 0\.001 rad; it"):
        approach(Servo(blocked=True), (0.3, 0.0, 0.0, 0.0))


def test_a_start_that_is_not_reached_in_time_is_told():
    with pytest.raises(MotionStoppedError, match=r"not at the start after 2 s: shoulder is far"):
        approach(Servo(), settings=ControllerSettings(approach_timeout=2.0))
    noisy = Servo(noise=0.05)
    with pytest.raises(MotionStoppedError, match=r"not at the start after 60 s|comes no nearer"):
        approach(noisy, NEAR)


def test_a_robot_that_swings_is_not_at_its_start():
    settings = ControllerSettings()
    motion = Approach(NAMES, np.zeros(4), LIMIT, settings)
    for step in range(300):
        time = STEP * step
        swing = np.array([5e-4 * np.sin(90.0 * time), 0.0, 0.0, 0.0])
        slide = swing + np.array([0.0, 0.05 * (time - 0.75), 0.0, 0.0])
        assert not motion.command(reading(time, slide)).done
