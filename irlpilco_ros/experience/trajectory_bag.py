"""Bags of trajectories that did not come over the wire, such as those of a simulation."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_message import BagMessage, BagTopic, joints_entry
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS, JointStateMessage, encode
from irlpilco_ros.experience.trajectory import Trajectory


def write_trajectory(directory: Path, trajectory: Trajectory) -> Path:
    """Write a trajectory as the recorder would have, under the next free number.

    Stamps become the log times too. `read_bag` gives the same trajectory back, stamps to the
    nanosecond.

    Args:
        directory: Where bags lie; made if need be.
        trajectory: What to write.

    Returns:
        The new bag, directory/NNN.

    Raises:
        BagError: it cannot be written.
    """
    with DurableBagWriter.numbered(directory, joints_entry(trajectory.joint_names)) as writer:
        for message in _messages(trajectory):
            writer.append(message)
    return writer.path


def _messages(trajectory: Trajectory) -> Iterator[BagMessage]:
    states, commands = BagTopic.joint_state("/joint_states"), BagTopic.joint_state("/joint_command")
    names = trajectory.joint_names
    for k, seconds in enumerate(trajectory.stamps):
        stamp = round(seconds * NANOSECONDS)
        if trajectory.observed[k]:
            state = JointStateMessage(
                stamp, names, _tuple(trajectory.positions[k]), _tuple(trajectory.velocities[k])
            )
            yield BagMessage(states, encode(state), stamp, stamp)
        if trajectory.commanded[k]:
            command = JointStateMessage(stamp, names, velocities=_tuple(trajectory.commands[k]))
            yield BagMessage(commands, encode(command), stamp, stamp)


def _tuple(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
