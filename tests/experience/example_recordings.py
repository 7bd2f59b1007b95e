"""Recordings of a smooth motion at any rate, for the tests of this folder."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_message import BagMessage, BagTopic
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.trajectory import Trajectory

JOINTS = ("shoulder", "elbow")
ROBOT = RobotSettings(
    joints=JOINTS,
    position_lower=(-2.0, -2.0),
    position_upper=(2.0, 2.0),
    velocity_limit=(1.0, 1.0),
    control_period=0.5,
)
_SIZE = np.array([0.8, -0.5])
_PLACE = np.array([0.3, 0.6])


def way(times, duration=8.0, size=1.0, offset=(0.0, 0.0)):
    """Positions and velocities (n, 2) of a motion from standstill to standstill."""
    s = np.clip(np.asarray(times, dtype=float) / duration, 0.0, 1.0)[:, None]
    passed = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    speed = 30.0 * s**2 * (1.0 - s) ** 2 / duration
    # Fast at once, as a hand is, so that the motion has an onset.
    passed, speed = 0.5 * (passed + s), 0.5 * (speed + (s > 0.0) * (s < 1.0) / duration)
    return _PLACE + np.array(offset) + size * _SIZE * passed, size * _SIZE * speed


def moving(rate, before=0.0, after=0.0, duration=8.0, size=1.0, offset=(0.0, 0.0)) -> Trajectory:
    """A recording of it at `rate` [Hz], with standstill before and after [s]."""
    times = np.arange(np.floor((before + duration + after) * rate + 1e-9) + 1.0) / rate
    positions, velocities = way(times - before, duration, size, offset)
    return Trajectory(
        JOINTS, 1000.0 + times, positions, velocities, np.full(positions.shape, np.nan)
    )


def write_as(recorded: Trajectory, bag: Path, **changes) -> Path:
    """Write a recording as a driver publishes it that tells `velocities` of so many joints."""
    topic, velocities = BagTopic.joint_state("/joint_states"), changes.get("velocities")
    with DurableBagWriter(bag) as writer:
        for stamp, at, speed in zip(
            recorded.stamps, recorded.positions, recorded.velocities, strict=True
        ):
            time = round(1e9 * stamp)
            told = tuple(speed[:velocities].tolist())
            message = JointStateMessage(time, recorded.joint_names, tuple(at.tolist()), told)
            writer.append(BagMessage(topic, encode(message), time, time))
    return bag


def read_as(recorded: Trajectory, folder: Path, **changes) -> Trajectory:
    """Return what is read of such a bag."""
    return dataclasses.replace(read_bag(write_as(recorded, folder / "bag", **changes)))
