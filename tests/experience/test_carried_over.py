"""A demonstration where its object is now: positions, velocities, ticks, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from planar_arm import planar, planar_hand

from irlpilco_ros.experience.carried_over import carried_over, retimed
from irlpilco_ros.experience.demonstration_checks import wanted_by
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.shown_motion import ShownMotion, shown_motion
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.kinematics.rigid_motion import inverse, pose

ROBOT = RobotSettings(
    joints=("joint0", "joint1", "joint2"),
    position_lower=(-2.5,) * 3,
    position_upper=(2.5,) * 3,
    velocity_limit=(2.0,) * 3,
    control_period=0.25,
)
CENTRE = (0.5, 0.4, 0.0)
"""Where the object lay [m]."""
NOISE = 4e-4  # [rad]


def way(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions [rad] and velocities [rad/s] of a motion that stands at both ends."""
    share = np.clip(times / 2.0, 0.0, 1.0)
    size = np.array([0.4, 0.5, -0.3])
    travelled = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    speed = 30.0 * share**2 * (1.0 - share) ** 2 / 2.0
    return np.array([0.2, 0.6, 0.4]) + np.outer(travelled, size), np.outer(speed, size)


def shown(rate: float = 100.0, noise: float = 0.0) -> ShownMotion:
    times = np.arange(-0.5, 2.5 + 1e-9, 1.0 / rate)
    positions, velocities = way(times)
    rng = np.random.default_rng(0)
    positions = positions + noise * rng.standard_normal(positions.shape)
    velocities = velocities + 12.0 * noise * rng.standard_normal(positions.shape)
    nothing = np.full_like(positions, np.nan)
    recorded = Trajectory(ROBOT.joints, 100.0 + times, positions, velocities, nothing)
    return shown_motion(recorded, wanted_by(ROBOT))


def move_by(x: float, y: float, turn: float) -> np.ndarray:
    now = pose(np.add(CENTRE, (x, y, 0.0)), (0.0, 0.0, turn))
    return now @ inverse(pose(CENTRE))


CARRIER = Carrier(planar(), ROBOT.lower, ROBOT.upper)


@pytest.mark.parametrize("rate", [100.0, 20.0])
@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_the_hand_goes_its_way_at_the_ticks_and_between_them(rate, noise):
    motion, move = shown(rate, noise), move_by(-0.05, 0.04, 0.2)
    moved = carried_over(motion, move, CARRIER, ROBOT)
    assert moved.rollout.steps == motion.rollout.steps
    assert not moved.rollout.commanded
    # A hand that must be somewhere, turned in some way, leaves these three joints no choice.
    ticks = motion.begin - 0.5 + 0.25 * np.arange(motion.rollout.steps + 1)
    for state, (positions, velocities) in zip(
        moved.rollout.states, zip(*way(ticks), strict=True), strict=True
    ):
        x, y, direction = planar_hand(positions)
        expected = move @ (x, y, 0.0, 1.0)
        np.testing.assert_allclose(
            planar_hand(state[:3]), [*expected[:2], direction + 0.2], atol=1e-3 + 4.0 * noise
        )
        step = 1e-4
        before, after = (planar_hand(state[:3] + sign * step * state[3:]) for sign in (-1, 1))
        x0, y0, _ = planar_hand(positions - step * velocities)
        x1, y1, _ = planar_hand(positions + step * velocities)
        wanted = (move @ (x1, y1, 0.0, 1.0) - move @ (x0, y0, 0.0, 1.0))[:2] / (2 * step)
        reached = (after - before)[:2] / (2.0 * step)
        np.testing.assert_allclose(reached, wanted, atol=0.02 + 20.0 * noise)
    assert moved.samples.cadence == pytest.approx(1.0 / rate)


def test_an_object_that_stays_leaves_the_demonstration_as_it_was():
    motion = shown(noise=NOISE)
    moved = carried_over(motion, np.eye(4), CARRIER, ROBOT)
    np.testing.assert_allclose(moved.rollout.states, motion.rollout.states, atol=1e-6)


def test_what_was_recorded_long_before_the_motion_does_not_come_along():
    """The hand may come from where it could not be carried over."""
    motion = shown()
    positions = motion.samples.positions.copy()
    positions[:30] = [2.4, 0.1, 0.0]
    odd = dataclasses.replace(motion.samples, positions=positions)
    moved = carried_over(
        dataclasses.replace(motion, samples=odd), move_by(-0.05, 0.04, 0.2), CARRIER, ROBOT
    )
    assert len(moved.samples) < len(motion.samples) - 30
    expected = carried_over(motion, move_by(-0.05, 0.04, 0.2), CARRIER, ROBOT)
    np.testing.assert_array_equal(moved.rollout.states, expected.rollout.states)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"velocity_limit": (0.3, 0.3, 0.3)}, r"joint\d goes from .* where its limit is 0\.3"),
        ({"acceleration_limit": (0.2, 0.2, 0.2)}, r"rad/s\^2, .* acceleration_limit is 0\.2"),
    ],
)
def test_too_fast_is_refused(changed, words):
    with pytest.raises(UnreachableError, match=words):
        carried_over(
            shown(), move_by(-0.05, 0.04, 0.2), CARRIER, dataclasses.replace(ROBOT, **changed)
        )


@pytest.mark.parametrize("rate", [100.0, 20.0])
@pytest.mark.parametrize(("speed", "steps"), [(0.5, 14), (0.8, 9), (1.3, 6), (1.5, 5)])
def test_at_another_speed_it_goes_the_same_way_in_other_times(rate, speed, steps):
    motion = shown(rate, NOISE)
    assert motion.rollout.steps == 7
    fast = retimed(motion, ROBOT, speed)
    assert fast.rollout.steps == steps
    assert fast.samples.cadence == pytest.approx(1.0 / rate / speed)
    ticks = motion.begin - 0.5 + 0.25 * speed * np.arange(steps + 1)
    positions, velocities = way(ticks)
    np.testing.assert_allclose(fast.rollout.states[:, :3], positions, atol=2e-3)
    np.testing.assert_allclose(fast.rollout.states[:, 3:], speed * velocities, atol=0.07)
    moved = carried_over(motion, np.eye(4), CARRIER, ROBOT, speed)
    np.testing.assert_allclose(moved.rollout.states, fast.rollout.states, atol=1e-4)
    as_shown = retimed(motion, ROBOT, 1.0)
    np.testing.assert_array_equal(as_shown.rollout.states, motion.rollout.states)


def test_where_a_recording_ends_before_the_last_period_does_the_robot_stands():
    motion = shown()
    times = motion.samples.stamps - motion.samples.stamps[0] - motion.begin
    kept = dataclasses.replace(
        motion.samples,
        **{
            name: getattr(motion.samples, name)[times <= 1.75]
            for name in ("stamps", "positions", "velocities", "commands")
        },
    )
    fast = retimed(dataclasses.replace(motion, samples=kept), ROBOT, 1.3)
    assert fast.rollout.steps == 6  # 1.5 s for what takes 1.35 s
    end = kept.positions[-1]
    np.testing.assert_allclose(fast.rollout.states[-1, :3], end, atol=1e-9)
    np.testing.assert_array_equal(fast.rollout.states[-1, 3:], 0.0)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"velocity_limit": (0.5, 0.5, 0.5)}, r"its limit is 0\.5; that is at speed 1\.5"),
        ({"acceleration_limit": (1.6, 1.6, 1.6)}, r"acceleration_limit is 1\.6; that is at speed"),
    ],
)
def test_a_speed_that_a_joint_cannot_do_is_refused(changed, words):
    robot = dataclasses.replace(ROBOT, **changed)
    retimed(shown(), robot, 1.0)
    with pytest.raises(UnreachableError, match=words):
        retimed(shown(), robot, 1.5)


def test_out_of_reach_is_refused():
    with pytest.raises(UnreachableError, match="pen is out of reach"):
        carried_over(shown(), move_by(0.6, 0.0, 0.0), CARRIER, ROBOT)
