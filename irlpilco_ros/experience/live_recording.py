"""A recording under way: from messages on the wire to samples on disk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from irlpilco_ros.experience.bag_message import BagMessage, BagTopic, joints_entry
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_merging import JointMerger, Received, Silence
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS, decode
from irlpilco_ros.experience.motion import MotionSettings
from irlpilco_ros.experience.recording_tally import RecordingTally
from irlpilco_ros.experience.sampling import Sample, Sampler

TopicSource = Callable[[], BagTopic]
"""Tells about a topic; asked once, when its first message is to be written."""

_LARGEST_PENDING = 1 << 20  # [bytes]


class LiveRecording:
    """One recording into one bag, which is made when the first sample has come.

    Attributes:
        path: The bag, or None as long as there is no sample.
        failure: Why the recording ended by itself; empty as long as it goes on.
    """

    def __init__(
        self,
        directory: Path,
        joints: Sequence[str],
        period: int,
        state_topic: TopicSource,
        command_topic: TopicSource,
        continuous: Sequence[str] = (),
        full_rate: bool = True,
        motion: MotionSettings | None = None,
        known: Sequence[BagMessage] = (),
    ) -> None:
        """Wait for the first sample.

        Args:
            directory: Where bags lie; made if need be.
            joints: Joints to record.
            period: Time between samples as long as there are no commands [ns].
            state_topic: Topic of the joint states.
            command_topic: Topic of the commands.
            continuous: Those of the joints that turn without end.
            full_rate: Whether all joint states and commands are kept beside the samples.
            motion: What counts as motion; None for the default.
            known: Messages that were known before, such as where the object is; the bag begins
                with them.
        """
        self.path: Path | None = None
        self.failure = ""
        self._directory = directory
        self._joints = tuple(joints)
        self._merger = JointMerger(joints, period)
        self._sampler = Sampler(joints, period, all_commands=not full_rate)
        self._tally = RecordingTally(joints, continuous, motion)
        self._writer: DurableBagWriter | None = None
        self._state_topic = cache(state_topic)
        self._command_topic = cache(command_topic)
        self._all_states = cache(lambda: self._state_topic().at_full_rate)
        self._all_commands = cache(lambda: self._command_topic().at_full_rate)
        self._moving = False
        self._first = 0
        self._full_rate = full_rate
        self._pending: list[BagMessage] = list(known)
        self._pending_size = 0  # [bytes]

    @property
    def samples(self) -> int:
        """Number of samples on disk."""
        return self._tally.samples

    @property
    def settled(self) -> bool:
        """Whether nothing more belongs to the recording: a trial's last command is zero."""
        return bool(self.failure) or not (self._moving or self._sampler.is_waiting)

    @property
    def fault(self) -> str:
        """What is wrong at present: why the recording ended, or which joints fell silent."""
        return self.failure or self._told(self._merger.silent())

    def take_state(self, state: Received) -> None:
        """Take in a joint state; what makes a sample is on disk when this returns."""
        self._take(lambda: self._samples_of(state))

    def take_command(self, command: Received) -> None:
        """Take in a command; what makes a sample is on disk when this returns."""
        self._take(lambda: self._decisions_of(command))

    def take_other(self, message: BagMessage) -> None:
        """Take in what is neither a state nor a command; it is on disk with the next sample."""
        self._pending.append(message)
        self._pending_size += len(message.data)

    def flush(self) -> None:
        """Bring to disk what is no sample, and look whether the bag is still there."""
        self._take(self._flush)

    def close(self) -> None:
        """End the recording; the bag is whole then, unless `failure` says otherwise."""
        if self._writer is None:
            return
        try:
            if not self.failure:
                self._write(self._sampler.drain())
                self._flush()
            self._writer.close()
        except BagError as error:
            self.failure = self.failure or str(error)

    def outcome(self) -> tuple[bool, str]:
        """Return whether there is something to learn from, and what the recording holds."""
        fault = self.fault
        if not fault and self.samples < 2:
            fault = "after its first sample no other joint state came; there is nothing to learn of"
        silences = self._told(self._merger.silences)
        return not fault, "; ".join(filter(None, [fault, self._tally.summary(), silences]))

    def beginning(self) -> str:
        """Return what is to be said when the first sample is there; empty for nothing."""
        lacking = self._merger.without_velocities
        if not lacking:
            return ""
        which = "" if lacking == self._joints else f" of {', '.join(lacking)}"
        return f"velocities{which} are not published; they will be computed from positions"

    def obstacle(self) -> str:
        """Return why there is no sample yet."""
        merger = self._merger
        reasons = dict.fromkeys(merger.unusable.values())
        unusable = [
            f"{', '.join(joint for joint, told in merger.unusable.items() if told == reason)}: "
            f"{reason}"
            for reason in reasons
        ]
        if unusable:
            return f"unusable: {'; '.join(unusable)}"
        if merger.missing:
            return f"missing: {', '.join(merger.missing)}"
        apart = merger.apart / NANOSECONDS
        return f"what is told of the joints lies {apart:.3f} s apart, by its stamps"

    def _samples_of(self, state: Received) -> list[Sample]:
        known = self._merger.accepted
        moment = self._merger.take(state)
        if self.samples and self._merger.accepted > known:
            self._keep(self._all_states(), state)
        if moment is None:
            return []
        if moment.whole:
            self._tally.trace(moment.stamp, self._merger.positions)
        return self._sampler.take_state(moment)

    def _decisions_of(self, command: Received) -> list[Sample]:
        if self.samples:
            self._keep(self._all_commands(), command)
        return self._sampler.take_command(command)

    def _take(self, sample: Callable[[], list[Sample]]) -> None:
        if self.failure:
            return
        try:
            self._write(sample())
            if self._pending_size > _LARGEST_PENDING:
                self._flush()
        except BagError as error:
            self.failure = str(error)
            self.close()

    def _flush(self) -> list[Sample]:
        if self._writer is not None:
            self._writer.look()
            if self._pending:
                self._append([])
        return []

    def _keep(self, topic: BagTopic, message: Received) -> None:
        """Keep a message at full rate, to be written with the next sample or flush."""
        if self._full_rate:
            self._pending.append(_entry(topic, message, message.received))
            self._pending_size += len(message.data)

    def _write(self, samples: list[Sample]) -> None:
        for sample in samples:
            states, topic = sample.states, self._state_topic()
            if states and not self.samples:
                self._first = states[-1].stamp
                for state in states:
                    self._keep(self._all_states(), state)
            # One log time marks the messages of one sample, should there be several.
            messages = [_entry(topic, state, states[-1].received) for state in states]
            if (command := sample.command) is not None:
                messages.append(_entry(self._command_topic(), command, command.received))
            self._append(messages)
            if command is not None:
                self._moving = any(decode(command.data).command)
                self._tally.decide(command.stamp)
            if states:
                self._tally.observe(states[-1].stamp)

    def _append(self, messages: list[BagMessage]) -> None:
        """Write what was kept at full rate, then messages; all of it is on disk then."""
        if self._writer is None:
            custom = joints_entry(self._joints)
            self._writer = DurableBagWriter.numbered(self._directory, custom)
        pending, self._pending, self._pending_size = self._pending, [], 0
        self._writer.append(*pending, *messages)
        self.path = self._writer.path

    def _told(self, silences: Sequence[Silence]) -> str:
        """Return since when which joints were silent."""
        return "; ".join(self._sentence(each) for each in silences)

    def _sentence(self, silence: Silence) -> str:
        joints = ", ".join(silence.joints)
        reasons = {self._merger.unusable.get(joint) for joint in silence.joints} - {None}
        why = f" ({', '.join(str(reason) for reason in reasons)})" if reasons else ""
        begin = (silence.begin - self._first) / NANOSECONDS
        if silence.end is None:
            newest = (max(self._merger.newest, self._first) - self._first) / NANOSECONDS
            return f"{joints} fell silent{why} after {begin:.1f} s of {newest:.1f} s"
        end = (silence.end - self._first) / NANOSECONDS
        return f"{joints} silent from {begin:.1f} s to {end:.1f} s"


def _entry(topic: BagTopic, message: Received, log_time: int) -> BagMessage:
    return BagMessage(topic, message.data, log_time, message.sent)
