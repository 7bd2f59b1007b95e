"""Which of the messages on the wire make a sample: the recorder's rules, without ROS.

Without commands, joint states are sampled at a fixed rate of message time. With commands, every
command that was newly decided makes a sample, with the joint state that bears the command's
stamp: just what the policy saw, at any simulation speed and in whatever order the two arrive. Of
what else is sent on that decision the zero that ends a trial, after the robot has braked, is kept
with it, or all that differs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irlpilco_ros.experience.joint_merging import Moment, Received
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS, decode

MEMORY = 20 * NANOSECONDS
"""How long a state waits for its command, or a command for its state, in message time [ns].

Long, because a simulation may run far ahead of a busy recorder, and one queue ahead of the other.
"""

_EARLY = NANOSECONDS // 1000  # a state this much before its time [ns] counts as in time


@dataclass(frozen=True)
class Sample:
    """What is to be written together.

    Attributes:
        states: Messages that tell all joints, oldest first; the last one bears the stamp. Empty
            if they are written already, or were never received.
        command: The command decided on them, if there is one, or what else was sent on it.
    """

    states: tuple[Received, ...]
    command: Received | None = None


class Sampler:
    """Picks samples out of the stream of joint states and commands."""

    def __init__(self, joints: Sequence[str], period: int, all_commands: bool = False) -> None:
        """Pick samples of these joints, every `period` [ns] as long as there are no commands.

        Args:
            joints: Joints to record.
            period: As above [ns].
            all_commands: Whether all that is sent on a decision is kept, as far as it differs.
        """
        self._all_commands = all_commands
        self._decision: tuple[float, ...] = ()
        self._joints = frozenset(joints)
        self._period = period
        self._recent: dict[int, tuple[Received, ...]] = {}  # empty once they are written
        self._waiting: dict[int, list[Received]] = {}
        self._first: int | None = None
        self._newest: int | None = None
        self._due: int | None = None
        self._decided: int | None = None
        self._heard: int | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether a command waits for its joint state."""
        return bool(self._waiting)

    def take_state(self, moment: Moment) -> list[Sample]:
        """Take in what is known of the joints and return what has become a sample.

        Without commands, only what is whole is one; a policy decides on what it was told last.
        """
        if self._first is None:
            if not moment.whole:
                return []
            self._first = moment.stamp
        stamp = moment.stamp
        self._newest = stamp if self._newest is None else max(stamp, self._newest)
        # The first one of a stamp, should several publishers give it: that is acted upon.
        self._recent.setdefault(stamp, moment.parts)
        oldest = next(iter(self._recent))
        if oldest < stamp - MEMORY:
            del self._recent[oldest]
        return [*self._sample_state(moment), *self._give_up()]

    def take_command(self, command: Received) -> list[Sample]:
        """Take in a command and return what has become a sample."""
        if self._joints.isdisjoint(command.names):
            return []
        self._heard = self._newest
        if self._decided is not None and command.stamp <= self._decided:
            return self._repeated(command)
        self._decided, self._decision = command.stamp, _values(command)
        if command.stamp in self._recent:
            return self._pair([command])
        self._waiting[command.stamp] = [command]
        return []

    def drain(self) -> list[Sample]:
        """Return the commands whose states never came: at the end of a recording."""
        waiting, self._waiting = self._waiting, {}
        return [sample for commands in waiting.values() for sample in self._alone(commands)]

    def _sample_state(self, moment: Moment) -> list[Sample]:
        stamp = moment.stamp
        if stamp in self._waiting:
            return self._pair(self._waiting.pop(stamp))
        if not moment.whole or (self._due is not None and stamp < self._due - _EARLY):
            return []
        if self._heard is not None and stamp < self._heard + self._period:
            return []
        due = stamp if self._due is None else self._due
        self._due = due + self._period * (1 + max(0, stamp - due) // self._period)
        self._recent[stamp] = ()
        return [Sample(moment.parts)]

    def _pair(self, commands: list[Received]) -> list[Sample]:
        """Return the sample of a decision, and what else was sent on it."""
        decided, stamp = commands[0], commands[0].stamp
        self._due = max(self._due or 0, stamp + self._period)
        return [Sample(self._take_out(stamp), decided), *self._alone(commands[1:])]

    def _repeated(self, command: Received) -> list[Sample]:
        """Return what else is sent on the last decision, if it is to be kept and can be now."""
        if command.stamp != self._decided:
            return []
        values = _values(command)
        is_end = any(self._decision) and not any(values)
        is_kept = is_end or (self._all_commands and values != self._decision)
        if not is_kept:
            return []
        if command.stamp in self._waiting:
            self._waiting[command.stamp].append(command)
            return []
        return self._alone([command])

    def _take_out(self, stamp: int) -> tuple[Received, ...]:
        """Return the messages that tell all joints at this stamp, once: then they are written."""
        parts, self._recent[stamp] = self._recent[stamp], ()
        return parts

    def _give_up(self) -> list[Sample]:
        """Return the commands that have waited too long: their states are lost."""
        assert self._newest is not None
        late = [stamp for stamp in self._waiting if stamp < self._newest - MEMORY]
        return [sample for stamp in late for sample in self._alone(self._waiting.pop(stamp))]

    def _alone(self, commands: list[Received]) -> list[Sample]:
        """Return commands without a state, if they were decided after the recording had begun."""
        first = self._first
        return [Sample((), each) for each in commands if first is not None and each.stamp >= first]


def _values(command: Received) -> tuple[float, ...]:
    """Return what is commanded: velocities, which are decoded already, else efforts."""
    if command.velocities.size:
        return tuple(command.velocities.tolist())
    return tuple(decode(command.data).command)
