"""The simulated robot: servos as measured, holds, limits, noise, guiding, and its speed."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.errors import InvalidCommandError
from sim_bridge.joints import ARM_JOINTS, PUBLISHED_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.simulation_settings import SimulationSettings

STEP = 0.3  # [rad/s]
ZERO = np.zeros(14)


def quiet(**settings: Any) -> BaxterSimulation:
    return BaxterSimulation(SimulationSettings(position_noise=0.0, velocity_noise=0.0, **settings))


def drive(robot: BaxterSimulation, velocities: np.ndarray, periods: int) -> np.ndarray:
    """Command these velocities with every state; return velocities and positions over time."""
    history = []
    for _ in range(periods):
        robot.command(ARM_JOINTS, velocities)
        robot.step()
        history.append([robot.true_velocities, robot.true_positions])
    return np.array(history)


def step_response(robot: BaxterSimulation, joint: int) -> dict[str, float]:
    """Step one joint to 0.3 rad/s from the untucked pose, the right shoulder outwards."""
    robot.reset()
    start = robot.true_positions[joint]
    sign = -1.0 if ARM_JOINTS[joint] == "right_s0" else 1.0
    history = sign * drive(robot, sign * STEP * np.eye(14)[joint], 100)
    speed, travel = history[:, 0, joint], history[:, 1, joint] - sign * start
    steady = speed[80:].mean()
    return {
        "rise": (np.argmax(speed > 0.9 * steady) + 1) * 0.01,
        "error": 1.0 - steady / STEP,
        "behind_half": 0.5 * STEP - travel[49],
        "behind_one": 1.0 - travel[99] / STEP,
        "overshoot": speed.max() / steady - 1.0,
    }


def test_stiff_servos_follow_as_measured() -> None:
    robot = quiet(preset="stiff")
    for joint in range(14):
        response = step_response(robot, joint)
        assert response["rise"] <= 0.100
        assert -0.001 <= response["error"] <= 0.06
        assert response["behind_half"] <= 0.012
        assert response["overshoot"] <= 0.02


def test_compliant_servos_are_slow_and_fall_behind() -> None:
    robot = quiet()
    assert robot.settings.preset == "compliant"
    responses = [step_response(robot, joint) for joint in range(14)]
    rise = np.array([response["rise"] for response in responses])
    assert 0.1 <= rise.mean() <= 0.2
    assert rise.min() >= 0.05
    assert rise.max() <= 0.25
    behind = np.array([response["behind_one"] for response in responses])
    np.testing.assert_allclose(behind, 0.15, atol=0.05)


@pytest.mark.parametrize("preset", ["stiff", "compliant"])
def test_zero_command_does_not_drift(preset: str) -> None:
    robot = quiet(preset=preset)
    robot.reset(positions=load_motion().waypoints[0])
    start = robot.true_positions
    drive(robot, ZERO, 800)
    assert np.abs(robot.true_positions - start).max() < 1e-3


@pytest.mark.parametrize("preset", ["stiff", "compliant"])
def test_limit_to_limit_stays_finite_and_inside(preset: str) -> None:
    robot = quiet(preset=preset)
    lower, upper = robot.position_limits
    for sign in (1.0, -1.0, 1.0):
        history = drive(robot, sign * robot.velocity_limit, 300)
        assert np.isfinite(history).all()
        positions = history[:, 1]
        assert (positions > lower - 0.1).all()
        assert (positions < upper + 0.1).all()
        assert np.abs(history[:, 0]).max() < 20.0


def test_the_delayed_robot_runs_0_4_s_behind_at_constant_speed() -> None:
    behind = {}
    for preset in ("compliant", "delayed"):
        robot = quiet(preset=preset)
        start, speed = robot.true_positions, np.full(14, 0.05)
        for _ in range(300):
            robot.command(ARM_JOINTS, speed)
            robot.step()
        travelled = robot.true_positions - start
        behind[preset] = float(np.mean(robot.time - travelled / robot.true_velocities))
    assert behind["delayed"] - behind["compliant"] == pytest.approx(0.05 + 0.3, abs=0.02)
    assert 0.38 <= behind["delayed"] <= 0.6  # the soft servo's own part comes on top


def test_command_lag_delays_the_motion() -> None:
    joint = 6
    for lag, preset in ((0.0, "compliant"), (0.08, "compliant"), (0.08, "stiff")):
        robot = quiet(command_lag=lag, preset=preset)
        speed = drive(robot, STEP * np.eye(14)[joint], 20)[:, 0, joint]
        still = round(lag / 0.01)
        assert (np.abs(speed[:still]) < 1e-6).all()
        assert speed[still] > 0.01


def test_speed_factor_scales_each_joint() -> None:
    factors = np.linspace(0.6, 1.2, 14)
    plain = quiet(preset="stiff")
    scaled = quiet(preset="stiff", speed_factor=tuple(factors))
    for joint in (0, 3, 6, 7, 13):
        expected = step_response(plain, joint)["error"]
        response = step_response(scaled, joint)
        assert 1.0 - response["error"] == pytest.approx(factors[joint] * (1.0 - expected), rel=0.01)


def test_payload_sags() -> None:
    robot = quiet(payload=1.0)
    start = robot.true_positions
    drive(robot, ZERO, 100)
    assert robot.true_positions[1] - start[1] > 0.01


def test_holds_position_after_the_timeout() -> None:
    robot = quiet(preset="stiff")
    drive(robot, STEP * np.eye(14)[0], 100)
    moving = robot.true_velocities[0]
    for _ in range(15):
        robot.step()
    assert robot.true_velocities[0] == pytest.approx(moving, rel=0.02)
    for _ in range(10):
        robot.step()
    released = robot.true_positions.copy()
    for _ in range(200):
        robot.step()
    assert np.abs(robot.true_velocities).max() < 1e-3
    assert np.abs(robot.true_positions - released).max() < 0.03


def test_a_second_hold_is_where_the_second_command_ended() -> None:
    robot = quiet(preset="stiff")
    for _ in range(2):
        drive(robot, STEP * np.eye(14)[3], 50)
        before = robot.true_positions[3]
        for _ in range(300):
            robot.step()
        assert robot.true_positions[3] - before == pytest.approx(0.06, abs=0.03)


def test_joints_without_a_command_hold() -> None:
    robot = quiet()
    start = robot.true_positions
    for _ in range(100):
        robot.command(("right_w2",), [STEP])
        robot.step()
    travel = robot.true_positions - start
    assert travel[13] > 0.2
    assert np.abs(travel[:13]).max() < 0.01


def test_commands_are_clipped_to_the_limits() -> None:
    fast, limit = quiet(preset="stiff"), quiet(preset="stiff")
    command = 100.0 * np.eye(14)[0]
    np.testing.assert_array_equal(drive(fast, command, 30), drive(limit, 1.5 * np.eye(14)[0], 30))


@pytest.mark.parametrize(
    ("names", "velocities", "reason"),
    [
        (("left_s0", "left_s9"), [0.1, 0.1], "left_s9"),
        (("head_pan",), [0.1], "head_pan"),
        (("left_s0", "left_s1"), [0.1], "expected one for each"),
        (("left_s0",), [[0.1]], "expected one for each"),
        ((), [], "expected one for each"),
        (("left_s0", "left_s0"), [0.1, 0.2], "twice"),
        (("left_s0", "left_e1"), [0.1, float("nan")], "left_e1 is not finite"),
        (("left_s0",), [float("inf")], "not finite"),
    ],
)
def test_nonsense_is_rejected_without_effect(names: tuple, velocities: list, reason: str) -> None:
    robot, undisturbed = BaxterSimulation(), BaxterSimulation()
    with pytest.raises(InvalidCommandError, match=reason):
        robot.command(names, velocities)
    with pytest.raises(InvalidCommandError, match=reason):
        robot.guide(names, velocities, velocities)
    for _ in range(20):
        robot.step()
        undisturbed.step()
    np.testing.assert_array_equal(robot.true_positions, undisturbed.true_positions)


def test_reading_names_and_time() -> None:
    robot = BaxterSimulation()
    assert robot.published_names == PUBLISHED_JOINTS == tuple(sorted(PUBLISHED_JOINTS))
    assert len(PUBLISHED_JOINTS) == 17
    assert robot.read().stamp == 0
    for _ in range(3):
        robot.step()
    reading = robot.read()
    assert reading.stamp == 30_000_000
    assert robot.time == pytest.approx(0.03)
    assert reading.names == PUBLISHED_JOINTS
    assert reading is robot.read()
    fixed = [PUBLISHED_JOINTS.index(name) for name in ("head_nod", "torso_t0")]
    assert np.abs(reading.positions[fixed]).max() < 1e-6


def test_noise_has_the_size_that_is_set() -> None:
    robot = BaxterSimulation()
    errors = []
    for _ in range(500):
        robot.step()
        state = robot.read().state(ARM_JOINTS)
        errors.append(state - np.concatenate([robot.true_positions, robot.true_velocities]))
    spread = np.std(errors, axis=0)
    np.testing.assert_allclose(spread[:14], 4e-4, rtol=0.15)
    np.testing.assert_allclose(spread[14:], 5e-3, rtol=0.15)
    correlation = np.corrcoef(np.array(errors).T) - np.eye(28)
    assert np.abs(correlation).max() < 0.25


def moves(robot: BaxterSimulation) -> np.ndarray:
    """A feedback on noisy readings, so that any difference grows."""
    states = []
    for _ in range(60):
        state = robot.read().state(ARM_JOINTS)
        states.append(state)
        robot.command(ARM_JOINTS, 0.3 * np.sin(40.0 * state[:14]))
        robot.step()
    return np.array(states)


def test_same_seed_same_bits() -> None:
    first, second = (BaxterSimulation(SimulationSettings(seed=5, debris=3)) for _ in range(2))
    expected = moves(first)
    np.testing.assert_array_equal(moves(second), expected)
    first.reset()
    np.testing.assert_array_equal(moves(first), expected)
    first.reset(seed=6)
    assert np.abs(moves(first) - expected).max() > 1e-4


@pytest.mark.parametrize("preset", ["stiff", "compliant"])
def test_guided_joints_go_where_they_are_led(preset: str) -> None:
    motion = load_motion()
    robot = quiet(preset=preset, speed_factor=(0.7,), payload=0.5)
    robot.reset(positions=motion.waypoints[0])
    worst = 0.0
    while robot.time < motion.duration:
        positions, _ = motion.at(robot.time)
        worst = max(worst, np.abs(robot.true_positions - positions).max())
        robot.guide(motion.joints, *motion.at(robot.time))
        robot.step()
    assert worst < 4e-3


def test_a_hand_that_lets_go_leaves_the_arm_where_it_is() -> None:
    robot = quiet()
    goal = robot.true_positions + 0.1
    for _ in range(100):
        robot.guide(ARM_JOINTS, goal, ZERO)
        robot.step()
    np.testing.assert_allclose(robot.true_positions, goal, atol=1e-3)
    for _ in range(200):
        robot.step()
    np.testing.assert_allclose(robot.true_positions, goal, atol=2e-3)


def test_a_hand_far_away_pulls_no_harder() -> None:
    robot = quiet()
    fastest = 0.0
    for _ in range(150):
        robot.guide(("left_w0",), [robot.true_positions[4] + 2.0], [0.0])
        robot.step()
        fastest = max(fastest, robot.true_velocities[4])
    assert 0.5 < fastest < 2.0


def test_a_command_takes_over_from_the_hand() -> None:
    robot = quiet(preset="stiff")
    robot.guide(ARM_JOINTS, robot.true_positions, 0.2 * np.ones(14))
    robot.step()
    history = drive(robot, ZERO, 50)
    assert np.abs(history[-1, 0]).max() < 1e-3


def test_reset_starts_where_it_is_told() -> None:
    robot = quiet()
    start = robot.true_positions
    wanted = load_motion().waypoints[0]
    robot.reset(positions=wanted)
    np.testing.assert_array_equal(robot.true_positions, wanted)
    drive(robot, 0.2 * np.ones(14), 20)
    robot.reset()
    np.testing.assert_array_equal(robot.true_positions, start)
    assert robot.time == 0.0
    for _ in range(30):
        robot.step()
    np.testing.assert_allclose(robot.true_positions, start, atol=1e-6)


def test_settings_name_what_is_wrong() -> None:
    with pytest.raises(InvalidSettingError, match="speed_factor has 2 values; expected 1"):
        SimulationSettings(speed_factor=(1.0, 1.0))
    with pytest.raises(InvalidSettingError, match="preset is 'soft'; valid values: stiff, comp"):
        SimulationSettings(preset="soft")


def test_twenty_times_real_time() -> None:
    robot = BaxterSimulation()
    robot.reset(positions=load_motion().waypoints[0])
    best = 0.0
    for _ in range(3):
        begin, started = robot.time, time.process_time()
        drive(robot, 0.02 * np.ones(14), 200)
        best = max(best, (robot.time - begin) / (time.process_time() - started))
    assert best >= 20.0
