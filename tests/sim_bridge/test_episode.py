"""Trials in one process: the ticks of the nodes, and what replay and guiding come to."""

from __future__ import annotations

import numpy as np
import pytest

from sim_bridge import episode
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import (
    SETTINGS,
    move_to_start,
    play_demonstration,
    run_episode,
    run_trial,
)
from sim_bridge.errors import ApproachError
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.path_recorder import PathRecorder
from sim_bridge.simulation_settings import SimulationSettings


class Watcher:
    """A feedback policy that remembers when it was asked and what it saw."""

    def __init__(self, robot: BaxterSimulation) -> None:
        self.robot = robot
        self.calls: list[tuple[int, int, np.ndarray]] = []

    def act(self, state: np.ndarray, step: int) -> np.ndarray:
        self.calls.append((step, self.robot.read().stamp, state.copy()))
        return 0.2 * np.sin(30.0 * state[:14] + step)


class Replay:
    def __init__(self, controls: np.ndarray) -> None:
        self.controls = controls

    def act(self, _state: np.ndarray, step: int) -> np.ndarray:
        return self.controls[step]


def test_policy_decides_once_per_tick_on_what_is_measured() -> None:
    robot = BaxterSimulation()
    for _ in range(7):
        robot.step()
    policy = Watcher(robot)
    trial = run_trial(robot, policy, horizon=4, dt=0.5)
    begin = 70_000_000
    assert [step for step, _, _ in policy.calls] == [0, 1, 2, 3]
    assert [stamp for _, stamp, _ in policy.calls] == [begin + k * 500_000_000 for k in range(4)]
    assert robot.read().stamp == begin + 4 * 500_000_000
    np.testing.assert_array_equal(trial.states[:4], [state for _, _, state in policy.calls])
    np.testing.assert_array_equal(trial.states[4], robot.read().state(ARM_JOINTS))
    controls = [0.2 * np.sin(30.0 * state[:14] + step) for step, _, state in policy.calls]
    np.testing.assert_array_equal(trial.controls, controls)


def test_the_path_of_a_trial_and_of_a_demonstration_is_every_state_the_ticks_among_them() -> None:
    robot = BaxterSimulation()
    kept = PathRecorder(robot)
    trial = run_trial(robot, Watcher(robot), horizon=4, dt=0.5, each_state=kept.take)
    path = kept.path()
    np.testing.assert_allclose(path.times, 0.01 * np.arange(201), atol=1e-12)
    np.testing.assert_array_equal(np.hstack([path.positions, path.velocities])[::50], trial.states)
    kept = PathRecorder(robot)
    shown = play_demonstration(robot, each_state=kept.take)
    path = kept.path()
    np.testing.assert_allclose(path.times, 0.01 * np.arange(801), atol=1e-12)
    np.testing.assert_array_equal(np.hstack([path.positions, path.velocities])[::50], shown.states)


def test_a_period_that_is_no_multiple_of_10_ms_ends_at_the_next_state() -> None:
    robot = BaxterSimulation()
    policy = Watcher(robot)
    run_trial(robot, policy, horizon=3, dt=0.025)
    assert [stamp for _, stamp, _ in policy.calls] == [0, 30_000_000, 50_000_000]


def test_commands_do_not_time_out_within_a_period() -> None:
    robot = BaxterSimulation(SimulationSettings(preset="stiff"))
    controls = np.zeros((2, 14))
    controls[:, 13] = 0.3
    trial = run_trial(robot, Replay(controls), horizon=2)
    assert trial.states[2, 13] - trial.states[0, 13] == pytest.approx(0.29, abs=0.02)


def test_move_to_start_arrives_and_stands() -> None:
    start = load_motion().waypoints[0]
    for preset in ("stiff", "compliant"):
        robot = BaxterSimulation(SimulationSettings(preset=preset, speed_factor=(0.7,)))
        move_to_start(robot, start)
        assert np.abs(robot.true_positions - start).max() < SETTINGS.start_tolerance + 2e-3
        assert np.abs(robot.true_velocities).max() < 0.02


def test_move_to_start_says_what_is_in_the_way() -> None:
    robot = BaxterSimulation()
    goal = robot.true_positions
    goal[0] = robot.position_limits[1, 0] + 0.3
    with pytest.raises(ApproachError, match="left_s0 is commanded but does not move"):
        move_to_start(robot, goal)


def test_arms_that_caught_each_other_come_free() -> None:
    start = load_motion().waypoints[0]
    robot = BaxterSimulation(SimulationSettings(preset="stiff", seed=14))
    robot.reset(positions=start)
    rng = np.random.default_rng(14)
    wild = [rng.uniform(-1, 1, 14) * np.sign(np.sin(k / 3 + 14)) for k in range(16)]
    run_trial(robot, Replay(np.array(wild)), horizon=16)
    assert not episode._approach(robot, start).succeeded, "the straight way is blocked"
    move_to_start(robot, start)
    assert np.abs(robot.true_positions - start).max() < SETTINGS.start_tolerance + 2e-3


def test_demonstration_follows_the_sweep_and_nobody_commands() -> None:
    motion = load_motion()
    wanted = [motion.at(0.5 * k) for k in range(17)]
    for preset in ("stiff", "compliant"):
        shown = play_demonstration(BaxterSimulation(SimulationSettings(preset=preset)))
        assert shown.states.shape == (17, 28)
        assert not shown.commanded
        assert np.abs(shown.states[:, :14] - [at for at, _ in wanted]).max() < 8e-3
        assert np.abs(shown.states[:, 14:] - [speed for _, speed in wanted]).max() < 0.1


@pytest.mark.parametrize(
    ("preset", "low", "high"), [("stiff", 0.004, 0.010), ("compliant", 0.015, 0.027)]
)
def test_replay_is_as_far_off_as_on_the_robot(preset: str, low: float, high: float) -> None:
    shown = play_demonstration(BaxterSimulation(SimulationSettings(preset=preset)))
    positions = shown.states[:, :14]
    replay = Replay(np.diff(positions, axis=0) / 0.5)
    robot = BaxterSimulation(SimulationSettings(preset=preset, seed=1))
    trial = run_episode(robot, replay, positions[0], horizon=16)
    error = np.sqrt(np.mean((trial.states[1:, :14] - positions[1:]) ** 2))
    assert low < error < high


def test_same_seed_same_episode() -> None:
    start = load_motion().waypoints[0]
    trials = []
    for _ in range(2):
        robot = BaxterSimulation(SimulationSettings(seed=3))
        trials.append(run_episode(robot, Watcher(robot), start, horizon=3))
    np.testing.assert_array_equal(trials[0].states, trials[1].states)
    np.testing.assert_array_equal(trials[0].controls, trials[1].controls)
