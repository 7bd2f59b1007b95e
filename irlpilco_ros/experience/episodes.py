"""The recordings of a run, or one bag, as episodes: what other tools take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_reader import read_path
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.motion import unwrapped
from irlpilco_ros.experience.resampling import measured_velocities
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.numerics.arrays import Array

MOST_FRAMES = 50.0
"""Frames a second of the finest recording [Hz]: what learning from recordings usually has."""


@dataclass(frozen=True)
class Episode:
    """One recording.

    Attributes:
        name: Such as "trial_003".
        joints: Names of the J joints.
        times: Since it began (n,), rising [s].
        positions: (n, J) [rad].
        velocities: (n, J) [rad/s].
        commands: (n, J), the mean that was commanded in each control period, held through it;
            NaN before and without any [rad/s], or [Nm].
    """

    name: str
    joints: tuple[str, ...]
    times: Array
    positions: Array
    velocities: Array
    commands: Array

    @property
    def was_commanded(self) -> bool:
        """Whether a policy moved the robot; else somebody guided it."""
        return bool(np.isfinite(self.commands).any())

    @property
    def rate(self) -> float:
        """Joint states a second [Hz]."""
        return 1.0 / float(np.median(np.diff(self.times)))

    def at(self, frames: float) -> Episode:
        """Return it at so many frames a second [Hz], on straight lines between joint states."""
        count = int(self.times[-1] * frames + 1e-6) + 1
        times = np.arange(count) / frames
        positions, velocities = (
            np.stack([np.interp(times, self.times, column) for column in values.T], axis=1)
            for values in (self.positions, self.velocities)
        )
        held = np.searchsorted(self.times, times + 1e-6, side="right") - 1
        return Episode(self.name, self.joints, times, positions, velocities, self.commands[held])


def episodes_of_run(path: Path, continuous: Sequence[str] = ()) -> list[Episode]:
    """Return demonstrations and trials of a run, or the one recording of a bag.

    Args:
        path: A run directory, or a bag.
        continuous: Joints that turn without end: their positions do not wrap.

    Raises:
        BagError: a bag cannot be read, or tells of no motion.
        RunDirectoryError: the run's configuration cannot be read.
    """
    run = RunDirectory(path)
    if not run.configuration_file.exists():
        return [_episode(path.name, read_path(path), continuous, path)]
    continuous = tuple(run.configuration().get("continuous_joints", continuous))
    shown = [
        _episode(f"demonstration_{number:03d}", recorded, continuous, path)
        for number, recorded in enumerate(run.demonstration_paths())
    ]
    trials = [
        _episode(f"trial_{number:03d}", run.read_path(bag), continuous, bag)
        for number, bag in run.trial_bags()
    ]
    joints = shown[0].joints
    return [_with(joints, episode) for episode in (*shown, *trials)]


def common_rate(episodes: Sequence[Episode]) -> int:
    """Return the frames a second that all episodes can be told at [Hz]."""
    return max(1, round(min(MOST_FRAMES, *(episode.rate for episode in episodes))))


def _episode(name: str, recorded: Trajectory, continuous: Sequence[str], where: Path) -> Episode:
    told = recorded.observed
    if told.sum() < 2:
        raise BagError(f"{where} tells where the joints are {told.sum()} times; expected a motion")
    times = recorded.stamps[told] - recorded.stamps[told][0]
    positions = unwrapped(recorded.positions[told], recorded.joint_names, continuous)
    velocities = recorded.velocities[told]
    absent = ~np.isfinite(velocities)
    if absent.any():
        velocities = np.where(absent, measured_velocities(times, positions), velocities)
    commands = _held(recorded.commands[told])
    return Episode(name, recorded.joint_names, times, positions, velocities, commands)


def _held(commands: Array) -> Array:
    """Return commands (n, J) without the gaps between decisions."""
    decided = np.isfinite(commands).any(axis=1)
    if not decided.any():
        return commands
    last = np.maximum.accumulate(np.where(decided, np.arange(len(commands)), -1))
    return np.where((last >= 0)[:, None], commands[last], np.nan)


def _with(joints: tuple[str, ...], episode: Episode) -> Episode:
    """Return the episode with these joints, in this order.

    Raises:
        BagError: one of them was not recorded.
    """
    absent = [joint for joint in joints if joint not in episode.joints]
    if absent:
        raise BagError(f"{episode.name} tells nothing of {', '.join(absent)}")
    columns = [episode.joints.index(joint) for joint in joints]
    return Episode(
        episode.name,
        joints,
        episode.times,
        episode.positions[:, columns],
        episode.velocities[:, columns],
        episode.commands[:, columns],
    )
