"""From the JointStates in a bag to a trajectory: which topics, which joints, which samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.bag_joint_states import JointStateColumns
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.rollout import mean_command

STATES, COMMANDS = "joint_states", "joint_command"
"""How the topics of joint states and of commands are called, in whatever namespace."""

_RESET = NANOSECONDS  # stamps that jump back by more than this are another clock's [ns]
# Messages that complete each other lie closer together than this many of their periods.
_APART = 0.6


@dataclass(frozen=True)
class Topics:
    """The JointStates of a bag by topic, and how to choose among them.

    Attributes:
        path: The bag.
        columns: JointStates of each topic that has any.
        recorded: Joints that the recorder was told to record; empty if it left no word.
        others: Names of the topics that hold something else.
    """

    path: Path
    columns: Mapping[str, JointStateColumns]
    recorded: tuple[str, ...] = ()
    others: tuple[str, ...] = ()

    def states(self, topic: str = "") -> list[str]:
        """Return the topics of the joint states: the chosen one, or those that go together.

        Args:
            topic: Which to take where several tell the same joints; with or without a slash.

        Raises:
            BagError: there are none, or several of which none is chosen; names them.
        """
        named = [name for name in self.columns if _last(name) != COMMANDS]
        chosen = [name for name in named if topic and name.strip("/") == topic.strip("/")]
        found = chosen or [name for name in named if _last(name) == STATES]
        if self.recorded and not chosen:
            wanted = set(self.recorded)
            found = [name for name in found if wanted & set(self.columns[name].names)] or found
        if not found:
            self._refuse(topic, named)
        if not self._complete_each_other(found):
            raise BagError(
                f"{self.path} has several topics of joint states that tell the same joints: "
                f"{', '.join(found)}; choose one of them by joint_states_topic"
                + (f" (there is no {topic})" if topic else "")
            )
        return found

    def commands(self, states: Sequence[str]) -> list[str]:
        """Return the topics of the commands, those in the namespaces of the states first.

        Raises:
            BagError: several command the same joints, and none of them is beside the states.
        """
        found = [name for name in self.columns if _last(name) == COMMANDS]
        if not self._complete_each_other(found):
            found = [name for name in found if _space(name) in set(map(_space, states))] or found
        if not self._complete_each_other(found):
            raise BagError(
                f"{self.path} has several topics that command the same joints: {', '.join(found)}"
            )
        return found

    def _refuse(self, topic: str, named: Sequence[str]) -> None:
        commands = [name for name in self.columns if _last(name) == COMMANDS]
        if named:
            raise BagError(
                f"{self.path} has no topic {topic or STATES}; choose one of its topics of "
                f"JointStates by joint_states_topic: {', '.join(named)}"
            )
        if not commands:
            raise BagError(
                f"{self.path} holds no sensor_msgs/msg/JointState; its topics: "
                f"{', '.join(self.others)}"
            )

    def _complete_each_other(self, topics: Sequence[str]) -> bool:
        names = [name for topic in topics for name in self.columns[topic].names]
        return len(topics) < 2 or len(set(names)) == len(names)


def build_trajectory(topics: Topics, topic: str = "", joints: Sequence[str] = ()) -> Trajectory:
    """Return the trajectory in a bag.

    Args:
        topics: What is in the bag.
        topic: See `Topics.states`.
        joints: Joints that make a sample, if the recorder left no word; empty for all.

    Raises:
        BagError: the joint states make no trajectory; says why.
    """
    names = topics.states(topic)
    states = _Merged(topics, names)
    commands = _Merged(topics, topics.commands(names))
    joints = _joints(topics, states, commands, joints)
    decided = _sent_on_each(commands.stamps, commands.table("commands", joints))
    found = _states(topics.path, joints, states, frozenset(decided))
    stamps = sorted({*found, *decided})
    blank = np.full((2, len(joints)), np.nan)
    values = np.array([found.get(stamp, blank) for stamp in stamps]).reshape(-1, 2, len(joints))
    controls = [decided.get(stamp, blank[0]) for stamp in stamps]
    return Trajectory(
        joint_names=tuple(joints),
        stamps=np.array(stamps, dtype=np.int64) / NANOSECONDS,
        positions=values[:, 0],
        velocities=values[:, 1],
        commands=np.array(controls).reshape(-1, len(joints)),
    )


class _Merged:
    """The messages of several topics, in the order in which they were recorded."""

    def __init__(self, topics: Topics, names: Sequence[str]) -> None:
        self._columns = [topics.columns[name] for name in names]
        for name, columns in zip(names, self._columns, strict=True):
            if columns.malformed:
                raise BagError(f"{topics.path}, {name}: {columns.malformed}")
        places = np.concatenate([np.array([], np.int64), *(each.places for each in self._columns)])
        self._order = np.argsort(places, kind="stable")
        self.stamps = self._sorted([each.stamps for each in self._columns], np.int64)
        self.names = tuple(dict.fromkeys(name for each in self._columns for name in each.names))

    def table(self, values: str, joints: Sequence[str]) -> NDArray[np.float64]:
        """Return the positions, velocities or commands (N, J); NaN where not told."""
        tables = [getattr(each, values)(joints) for each in self._columns]
        return self._sorted(tables, float).reshape(-1, len(joints))

    def _sorted(self, parts: list[np.ndarray], kind: type) -> np.ndarray:
        whole: np.ndarray = np.concatenate(parts)[self._order] if parts else np.array([], kind)
        return whole


def _joints(
    topics: Topics, states: _Merged, commands: _Merged, wanted: Sequence[str]
) -> tuple[str, ...]:
    """Return the joints: as the recorder says, else as wanted, else all that are told of."""
    told = {*states.names, *commands.names}
    if topics.recorded:
        return topics.recorded
    if wanted and told.issuperset(wanted):
        return tuple(wanted)
    return commands.names or states.names


def _sent_on_each(stamps: np.ndarray, rows: np.ndarray) -> dict[int, np.ndarray]:
    """Return the mean of the commands that bear each stamp; zero where they end with zero.

    All that is sent on one decision bears the stamp of its state. A trial ends with zero, perhaps
    after it has braked.
    """
    order = np.argsort(stamps, kind="stable")
    places, first = np.unique(stamps[order], return_index=True)
    sent: dict[int, np.ndarray] = {}
    groups = np.split(rows[order], first[1:]) if len(first) else []
    for stamp, group in zip(places.tolist(), groups, strict=True):
        sent[stamp] = mean_command(group) if group[-1].any() else group[-1]
    return sent


def _first_of_each(stamps: np.ndarray, rows: np.ndarray) -> dict[int, np.ndarray]:
    """Return the first row of each stamp."""
    first: dict[int, np.ndarray] = {}
    for stamp, row in zip(stamps.tolist(), rows, strict=True):
        first.setdefault(stamp, row)
    return first


def _states(
    path: Path, joints: Sequence[str], states: _Merged, decided: frozenset[int]
) -> dict[int, np.ndarray]:
    """Return positions and velocities (2, J) by stamp, of every sample that tells all joints."""
    positions, velocities = states.table("positions", joints), states.table("velocities", joints)
    if not joints or not len(positions):
        return {}
    told = ~np.isnan(positions)
    useful = told.any(axis=1)
    told, stamps = told[useful], states.stamps[useful]
    positions, velocities = positions[useful], velocities[useful]
    _check_clock(path, stamps)
    rows, sources = _samples(stamps, told, decided)
    columns = np.arange(len(joints))
    values = np.stack([positions[sources, columns], velocities[sources, columns]], axis=1)
    return _first_of_each(stamps[rows], values)


def _check_clock(path: Path, stamps: np.ndarray) -> None:
    """Check that the clock that gave the stamps [ns] (N,) was running, and never set back."""
    if len(stamps) > 2 and stamps.min() == stamps.max():
        raise BagError(
            f"all {len(stamps)} joint states in {path} bear the stamp "
            f"{stamps[0] / NANOSECONDS:.3f} s; without a time they make no motion"
        )
    newest = np.maximum.accumulate(stamps)
    back = np.flatnonzero(stamps < newest - _RESET)
    if len(back):
        raise BagError(
            f"the stamps in {path} jump back from {newest[back[0]] / NANOSECONDS:.3f} s to "
            f"{stamps[back[0]] / NANOSECONDS:.3f} s: the robot's clock was reset while recording"
        )


def _samples(
    stamps: np.ndarray, told: np.ndarray, decided: frozenset[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return which messages complete a sample (S,), and where each joint's values are (S, J).

    A message that tells all joints is a sample. Where several tell them, a sample is complete
    when every joint has been told anew, all of them together within a part of their period: a
    joint that falls silent makes no samples. Commands are decided on what was last told.
    """
    joints = told.shape[1]
    if told.all():
        return np.arange(len(told)), np.repeat(np.arange(len(told))[:, None], joints, axis=1)
    apart = _largest_distance(stamps, told)
    last, fresh = np.full(joints, -1), np.zeros(joints, bool)
    rows, sources = [], []
    for row, (stamp, now) in enumerate(zip(stamps.tolist(), told, strict=True)):
        last[now] = row
        fresh |= now
        if not fresh.all() and (stamp not in decided or (last < 0).any()):
            continue
        if stamp - stamps[last].min() <= apart:
            rows.append(row)
            sources.append(last.copy())
            fresh[:] = False
    return np.array(rows, int), np.array(sources, int).reshape(-1, joints)


def _largest_distance(stamps: np.ndarray, told: np.ndarray) -> float:
    """Return how far apart the messages of one sample may be [ns]."""
    steps = [np.diff(np.unique(stamps[column])) for column in told.T]
    periods = [float(np.median(each)) for each in steps if len(each)]
    return _APART * max(periods) if periods else float(_RESET)


def _last(topic: str) -> str:
    return topic.rsplit("/", 1)[-1]


def _space(topic: str) -> str:
    return topic.strip("/").rpartition("/")[0]
