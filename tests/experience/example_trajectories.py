"""Trajectories and bags that the tests of this folder share."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_reader import read_messages
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.policies import Policy

JOINTS = ("shoulder", "elbow", "wrist")


def demonstration(steps: int = 16, joints: tuple[str, ...] = JOINTS, seed: int = 0) -> Trajectory:
    """Joint states without commands, every 0.5 s."""
    random = np.random.default_rng(seed)
    shape = (steps + 1, len(joints))
    stamps = 1000.0 + 0.5 * np.arange(steps + 1)
    nothing = np.full(shape, np.nan)
    return Trajectory(joints, stamps, random.normal(size=shape), random.normal(size=shape), nothing)


def trial(
    steps: int = 16,
    joints: tuple[str, ...] = JOINTS,
    seed: int = 0,
    policy: Policy | None = None,
) -> Trajectory:
    """A trial with its zero command at the end, of a policy if there is one."""
    states = demonstration(steps, joints, seed)
    commands = np.random.default_rng(seed + 1).normal(size=states.positions.shape)
    if policy is not None:
        x = np.hstack([states.positions, states.velocities])
        commands = np.array([policy.act(x[t], t) for t in range(steps + 1)])
    commands[-1] = 0.0
    return Trajectory(joints, states.stamps, states.positions, states.velocities, commands)


def assert_same(left: Trajectory, right: Trajectory) -> None:
    assert left.joint_names == right.joint_names
    for name in ("stamps", "positions", "velocities", "commands"):
        np.testing.assert_array_equal(getattr(left, name), getattr(right, name), err_msg=name)


def torn_bag(folder: Path) -> Path:
    """A trial's bag that ends in the middle of its last message, as kill -9 leaves it."""
    bag = write_trajectory(folder, trial())
    last = list(read_messages(bag))[-1].data
    file = bag / f"{bag.name}_0.mcap"
    content = file.read_bytes()
    file.write_bytes(content[: content.rindex(last) + len(last) // 2])
    (bag / "metadata.yaml").unlink()
    return bag
