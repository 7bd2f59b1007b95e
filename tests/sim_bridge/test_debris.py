"""Debris: scattered by its seed, swept into the pan, counted, and never the physics' end."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.debris import debris_in_pan
from sim_bridge.episode import guide_through
from sim_bridge.errors import DivergedError
from sim_bridge.guided_motion import GuidedMotion
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.simulation_settings import SimulationSettings


def scattered(count: int, seed: int) -> BaxterSimulation:
    robot = BaxterSimulation(SimulationSettings(debris=count, debris_seed=seed))
    robot.reset(positions=load_motion().waypoints[0])
    return robot


def places(robot: BaxterSimulation, count: int) -> np.ndarray:
    return np.array([robot.data.body(f"debris_{i}").xpos for i in range(count)])


def test_seed_decides_where_it_lies() -> None:
    first, same, other = (places(scattered(8, seed), 8) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert np.abs(first - other).max() > 0.01
    distances = np.linalg.norm(first[:, None] - first[None], axis=2)[np.triu_indices(8, 1)]
    assert distances.min() > 0.014


def test_debris_stays_where_it_lies() -> None:
    robot = scattered(8, 0)
    before = places(robot, 8)
    for _ in range(200):
        robot.step()
    assert np.abs(places(robot, 8) - before).max() < 2e-3
    assert robot.debris_in_pan() == 0


def test_the_sweep_brings_it_into_the_pan() -> None:
    for seed in (0, 1):
        robot = scattered(10, seed)
        guide_through(robot, load_motion())
        assert robot.debris_in_pan() >= 8


def test_a_brush_in_the_air_brings_nothing() -> None:
    motion = load_motion()
    lifted = motion.waypoints - 0.15 * np.array([name == "right_s1" for name in ARM_JOINTS])
    robot = scattered(6, 0)
    guide_through(robot, GuidedMotion(motion.joints, motion.interval, lifted))
    assert robot.debris_in_pan() == 0


def test_counts_what_is_inside_the_pan() -> None:
    robot = scattered(3, 0)
    pan = robot.data.body("dustpan")
    rotation = pan.xmat.reshape(3, 3)
    for number, offset in enumerate([(0.0, -0.1, 0.17), (0.1, -0.2, 0.18), (0.0, -0.25, 0.17)]):
        address = robot.model.joint(f"debris_{number}").qposadr[0]
        robot.data.qpos[address : address + 3] = pan.xpos + rotation @ offset
    mujoco.mj_kinematics(robot.model, robot.data)
    assert debris_in_pan(robot.model, robot.data) == 2


@pytest.mark.parametrize("seed", [1, 14, 18])
def test_a_careless_sweep_does_not_break_the_physics(seed: int) -> None:
    motion = load_motion()
    rng = np.random.default_rng(seed)
    careless = motion.waypoints + 0.02 * rng.standard_normal(motion.waypoints.shape)
    robot = scattered(20, seed)
    guide_through(robot, GuidedMotion(motion.joints, motion.interval, careless))
    assert np.isfinite(robot.data.qpos).all()


def test_broken_physics_are_an_error_until_reset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo leaves its log
    robot = BaxterSimulation()
    robot.data.qvel[5] = np.nan
    with pytest.raises(DivergedError, match="broke down"):
        robot.step()
    robot.reset()
    robot.step()
    assert np.isfinite(robot.true_positions).all()


def test_the_pile_lies_where_it_is_laid_also_after_a_reset() -> None:
    robot, place = scattered(6, 0), (0.05, -0.03, 0.4)
    before = places(robot, 6)
    robot.lay_pile(place)
    moved = places(robot, 6)
    x, y = (before - [0.645, -0.15, 0.0])[:, :2].T
    expected = np.stack([np.cos(0.4) * x - np.sin(0.4) * y, np.sin(0.4) * x + np.cos(0.4) * y], 1)
    np.testing.assert_allclose(moved[:, :2], np.add(expected, (0.695, -0.18)), atol=1e-9)
    np.testing.assert_allclose(moved[:, 2], before[:, 2], atol=1e-9)
    for _ in range(50):
        robot.step()
    assert np.abs(places(robot, 6) - moved).max() < 2e-3
    robot.reset()
    np.testing.assert_allclose(places(robot, 6), moved, atol=1e-9)
    there = BaxterSimulation(SimulationSettings(debris=6, object_place=place))
    np.testing.assert_allclose(places(there, 6), moved, atol=1e-9)
