"""Which of the messages on the wire make a sample: the recorder's rules, without ROS.

Without commands, joint states are sampled at a fixed rate of message time. With commands, every
command that was newly decided makes a sample, with the joint state that bears the command's
stamp: just what the policy saw, at any simulation speed and in whatever order the two arrive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS

MEMORY = 20 * NANOSECONDS
"""How long a state waits for its command, or a command for its state, in message time [ns].

Long, because a simulation may run far ahead of a busy recorder, and one queue ahead of the other.
"""

_RESET = NANOSECONDS  # stamps that jump back by more than this are another clock's [ns]
_EARLY = NANOSECONDS // 1000  # a state this much before its time [ns] counts as in time


@dataclass(frozen=True)
class Received:
    """A joint state or command as it came over the wire.

    Attributes:
        stamp: header.stamp [ns].
        names: Joints that it tells or commands.
        data: Its bytes (CDR).
        received: When it came [ns], wall clock.
        sent: When it was sent [ns], the sender's wall clock.
    """

    stamp: int
    names: tuple[str, ...]
    data: bytes
    received: int
    sent: int


@dataclass(frozen=True)
class Sample:
    """What is to be written together.

    Attributes:
        states: Messages that tell all joints, oldest first; the last one bears the stamp. Empty
            if they are written already, or were never received.
        command: The command decided on them, if there is one.
    """

    states: tuple[Received, ...]
    command: Received | None = None


class Sampler:
    """Picks samples out of the stream of joint states and commands."""

    def __init__(self, joints: Sequence[str], period: int) -> None:
        """Pick samples of these joints, every `period` [ns] as long as there are no commands."""
        self._joints = tuple(joints)
        self._period = period
        self._latest: dict[str, Received] = {}
        self._recent: dict[int, tuple[Received, ...]] = {}  # empty once they are written
        self._waiting: dict[int, Received] = {}
        self._first: int | None = None
        self._newest: int | None = None
        self._due: int | None = None
        self._decided: int | None = None
        self._heard: int | None = None

    @property
    def missing_joints(self) -> tuple[str, ...]:
        """Joints that no message has told of yet."""
        return tuple(joint for joint in self._joints if joint not in self._latest)

    @property
    def is_waiting(self) -> bool:
        """Whether a command waits for its joint state."""
        return bool(self._waiting)

    def take_state(self, state: Received) -> list[Sample]:
        """Take in a joint state and return what has become a sample.

        Repeated stamps and messages without a wanted joint change nothing.

        Raises:
            BagError: the stamps jump back, as when a simulation is reset; samples of before and
                after make no one recording.
        """
        wanted = [joint for joint in self._joints if joint in state.names]
        if not wanted or state.stamp == self._newest:
            self._latest.update(dict.fromkeys(wanted, state))
            return []
        if self._newest is not None and state.stamp < self._newest:
            if state.stamp < self._newest - _RESET:
                raise BagError(
                    f"the stamps of joint_states jumped back from {self._newest / NANOSECONDS:.3f} "
                    f"s to {state.stamp / NANOSECONDS:.3f} s; the robot's clock was reset"
                )
            return []
        self._latest.update(dict.fromkeys(wanted, state))
        self._newest = state.stamp
        if self.missing_joints:
            return []
        if self._first is None:
            self._first = state.stamp
        self._remember(state.stamp)
        return [*self._sample_state(state.stamp), *self._give_up()]

    def take_command(self, command: Received) -> list[Sample]:
        """Take in a command and return what has become a sample."""
        if not set(self._joints) & set(command.names):
            return []
        self._heard = self._newest
        if self._decided is not None and command.stamp <= self._decided:
            return []
        self._decided = command.stamp
        if command.stamp in self._recent:
            return [self._pair(command)]
        self._waiting[command.stamp] = command
        return []

    def drain(self) -> list[Sample]:
        """Return the commands whose states never came: at the end of a recording."""
        alone = [Sample((), command) for command in self._waiting.values() if self._ours(command)]
        self._waiting.clear()
        return alone

    def _remember(self, stamp: int) -> None:
        """Keep the messages that tell all joints at this stamp for a while."""
        parts = {id(part): part for part in self._latest.values()}
        self._recent[stamp] = tuple(sorted(parts.values(), key=lambda part: part.received))
        oldest = next(iter(self._recent))
        if oldest < stamp - MEMORY:
            del self._recent[oldest]

    def _sample_state(self, stamp: int) -> list[Sample]:
        if stamp in self._waiting:
            return [self._pair(self._waiting.pop(stamp))]
        if self._due is not None and stamp < self._due - _EARLY:
            return []
        if self._heard is not None and stamp < self._heard + self._period:
            return []
        due = stamp if self._due is None else self._due
        self._due = due + self._period * (1 + max(0, stamp - due) // self._period)
        return [Sample(self._take_out(stamp))]

    def _pair(self, command: Received) -> Sample:
        self._due = max(self._due or 0, command.stamp + self._period)
        return Sample(self._take_out(command.stamp), command)

    def _take_out(self, stamp: int) -> tuple[Received, ...]:
        """Return the messages that tell all joints at this stamp, once: then they are written."""
        parts, self._recent[stamp] = self._recent[stamp], ()
        return parts

    def _give_up(self) -> list[Sample]:
        """Return the commands that have waited too long: their states are lost."""
        assert self._newest is not None
        late = [stamp for stamp in self._waiting if stamp < self._newest - MEMORY]
        commands = [self._waiting.pop(stamp) for stamp in late]
        return [Sample((), command) for command in commands if self._ours(command)]

    def _ours(self, command: Received) -> bool:
        """Whether a command was decided after the recording had begun."""
        return self._first is not None and command.stamp >= self._first
