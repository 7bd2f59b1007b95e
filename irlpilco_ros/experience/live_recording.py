"""A recording under way: from messages on the wire to samples on disk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from irlpilco_ros.experience.bag_message import BagMessage, BagTopic, joints_entry
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.experience.sampling import Received, Sample, Sampler

TopicSource = Callable[[], BagTopic]
"""Tells about a topic; asked once, when its first message is to be written."""


class LiveRecording:
    """One recording into one bag, which is made when the first sample has come.

    Attributes:
        path: The bag, or None as long as there is no sample.
        samples: Number of samples on disk.
        failure: Why the recording ended by itself; empty as long as it goes on.
    """

    def __init__(
        self,
        directory: Path,
        joints: Sequence[str],
        period: int,
        state_topic: TopicSource,
        command_topic: TopicSource,
    ) -> None:
        """Wait for the first sample.

        Args:
            directory: Where bags lie; made if need be.
            joints: Joints to record.
            period: Time between samples as long as there are no commands [ns].
            state_topic: Topic of the joint states.
            command_topic: Topic of the commands.
        """
        self.path: Path | None = None
        self.samples = 0
        self.failure = ""
        self._directory = directory
        self._joints = tuple(joints)
        self._sampler = Sampler(joints, period)
        self._writer: DurableBagWriter | None = None
        self._state_topic = cache(state_topic)
        self._command_topic = cache(command_topic)
        self._moving = False

    @property
    def missing_joints(self) -> tuple[str, ...]:
        """Joints that no message has told of yet."""
        return self._sampler.missing_joints

    @property
    def settled(self) -> bool:
        """Whether nothing more belongs to the recording: a trial's last command is zero."""
        return bool(self.failure) or not (self._moving or self._sampler.is_waiting)

    def take_state(self, state: Received) -> None:
        """Take in a joint state; what makes a sample is on disk when this returns."""
        self._take(lambda: self._sampler.take_state(state))

    def take_command(self, command: Received) -> None:
        """Take in a command; what makes a sample is on disk when this returns."""
        self._take(lambda: self._sampler.take_command(command))

    def close(self) -> None:
        """End the recording; the bag is whole then, unless `failure` says otherwise."""
        if self._writer is None:
            return
        try:
            if not self.failure:
                self._write(self._sampler.drain())
            self._writer.close()
        except BagError as error:
            self.failure = self.failure or str(error)

    def summary(self) -> str:
        """Return what the bag holds, as read back from disk, and the failure if there was one."""
        assert self.path is not None
        try:
            recorded = read_bag(self.path)
        except BagError as error:
            return "; ".join(filter(None, [self.failure, str(error)]))
        line = f"{len(recorded)} samples, {recorded.missing} missing"
        if len(recorded) > 1:
            line += f", one every {recorded.cadence:.3f} s"
        return "; ".join(filter(None, [self.failure, line]))

    def _take(self, sample: Callable[[], list[Sample]]) -> None:
        if self.failure:
            return
        try:
            self._write(sample())
        except BagError as error:
            self.failure = str(error)
            self.close()

    def _write(self, samples: list[Sample]) -> None:
        for sample in samples:
            if self._writer is None:
                custom = joints_entry(self._joints)
                self._writer = DurableBagWriter.numbered(self._directory, custom)
            for state in sample.states:
                # One log time marks the messages of one sample, should there be several.
                self._append(self._state_topic(), state, sample.states[-1].received)
            if sample.command is not None:
                received = sample.command.received
                self._append(self._command_topic(), sample.command, received)
                self._moving = any(decode(sample.command.data).command)
            self.samples += bool(sample.states)

    def _append(self, topic: BagTopic, message: Received, log_time: int) -> None:
        assert self._writer is not None
        self._writer.append(BagMessage(topic, message.data, log_time, message.sent))
        self.path = self._writer.path
