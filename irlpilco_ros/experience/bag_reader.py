"""Bags read back, whole or torn, in one walk: what they hold, and the trajectory in it.

Messages of other types than JointState are counted and forgotten, so that a bag with images needs
no more memory than one without.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from irlpilco_ros.experience.bag_files import storage_files
from irlpilco_ros.experience.bag_joint_states import JointStateColumns
from irlpilco_ros.experience.bag_message import FULL_RATE, BagMessage, BagTopic, recorded_joints
from irlpilco_ros.experience.bag_metadata import Metadata, read_metadata
from irlpilco_ros.experience.bag_storage import StorageScan
from irlpilco_ros.experience.bag_trajectory import Topics, build_trajectory
from irlpilco_ros.experience.errors import BagError, UnreadableBagError
from irlpilco_ros.experience.joint_state_cdr import JOINT_STATE, StreamReader, decode_ros1
from irlpilco_ros.experience.trajectory import Trajectory


@dataclass(frozen=True)
class Recording:
    """Everything that can be read of a bag.

    Attributes:
        path: The bag.
        counts: Number of messages of each topic.
        first: Time of the first message [ns], wall clock.
        last: Time of the last message [ns], wall clock.
        joint_states: The JointStates of each topic that has any.
        custom: What else the recorder left.
        torn: Where the bag is torn off, or why it counts as not closed; the rest is there.
        damage: What cannot be read between what can.
        metadata_problem: What is wrong with metadata.yaml, which is written last.
        unverified: Number of messages that are whole, but whose checksum is not there.
    """

    path: Path
    counts: Mapping[BagTopic, int]
    first: int
    last: int
    joint_states: Mapping[str, JointStateColumns]
    custom: Mapping[str, str]
    torn: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    metadata_problem: str = ""
    unverified: int = 0

    @property
    def whole(self) -> bool:
        """Whether the bag was closed in good order, so that every tool reads it."""
        return not (self.torn or self.damage or self.metadata_problem)

    @property
    def message_count(self) -> int:
        """Number of messages, of whatever type."""
        return sum(self.counts.values())

    def trajectory(self, topic: str = "", joints: Sequence[str] = ()) -> Trajectory:
        """Return the samples in it; arguments and errors as `read_bag`."""
        samples = {
            name: each for name, each in self.joint_states.items() if not name.endswith(FULL_RATE)
        }
        return self._trajectory(samples, topic, joints)

    def path_taken(self, topic: str = "", joints: Sequence[str] = ()) -> Trajectory:
        """Return all that is known of the motion; arguments and errors as `read_path`."""
        told = self.joint_states
        best = {
            name: told.get(name + FULL_RATE, each)
            for name, each in told.items()
            if not name.endswith(FULL_RATE)
        }
        return self._trajectory(best, topic, joints)

    def _trajectory(
        self, columns: Mapping[str, JointStateColumns], topic: str, joints: Sequence[str]
    ) -> Trajectory:
        if self.damage:
            raise UnreadableBagError(
                f"{'; '.join(self.damage)}: what it shows is not what was recorded. irlpilco "
                "recover makes a bag of what is sound"
            )
        if not self.counts:
            raise UnreadableBagError(f"{self.path} holds no messages")
        others = tuple(
            f"{each.name} ({each.message_type or 'of no type'})"
            for each in self.counts
            if each.message_type != JOINT_STATE
        )
        topics = Topics(self.path, columns, recorded_joints(self.custom), others)
        return build_trajectory(topics, topic, joints)


def read_recording(path: Path, full_rate: bool = False) -> Recording:
    """Return everything that can be read of a bag, which may be torn.

    Args:
        path: The bag's folder or its only file.
        full_rate: Whether messages of which there are samples, too, are read and not only counted.

    Raises:
        BagError: there is no bag, or it is none that can be read.
    """
    bag = open_bag(path)
    columns: defaultdict[str, JointStateColumns] = defaultdict(JointStateColumns)
    readers: defaultdict[str, StreamReader] = defaultdict(StreamReader)
    place = 0
    for scan in bag.scans:
        for message in scan.messages():
            if message.topic.is_full_rate and not full_rate:
                continue
            name = message.topic.name
            _take(columns[name], readers[name], place, message)
            place += 1
    counts: Counter[BagTopic] = Counter()
    custom: dict[str, str] = {}
    for scan in bag.scans:
        counts.update(scan.counts)
        custom.update(scan.custom)
    filled = [scan for scan in bag.scans if scan.counts]
    return Recording(
        path=path,
        counts=counts,
        first=min((scan.first for scan in filled), default=0),
        last=max((scan.last for scan in filled), default=0),
        joint_states=dict(columns),
        custom={**(bag.metadata.custom or {}), **custom},
        torn=tuple(tear for scan in bag.scans for tear in scan.tears),
        damage=tuple(filter(None, [bag.lacking, *(d for scan in bag.scans for d in scan.damage)])),
        metadata_problem="" if _is_ros1(bag) else bag.metadata.problem,
        unverified=sum(scan.unverified for scan in bag.scans),
    )


@dataclass(frozen=True)
class OpenBag:
    """The files of a bag, before anything is read of them.

    Attributes:
        metadata: What metadata.yaml says.
        scans: A walk for each file, in order of recording.
        lacking: What says that files are missing; empty if none is.
    """

    metadata: Metadata
    scans: tuple[StorageScan, ...]
    lacking: str = ""


def open_bag(path: Path) -> OpenBag:
    """Return a walk for each file of a bag, in the order of metadata.yaml or else of their names.

    Raises:
        BagError: there is no bag.
    """
    files = storage_files(path)
    metadata = read_metadata(files[0].parent)
    if path == files[0] or not metadata.files:
        return OpenBag(metadata, tuple(map(StorageScan, files)))
    there = {file.name: file for file in files}
    absent = [name for name in metadata.files if name not in there]
    if not absent:
        return OpenBag(metadata, tuple(StorageScan(there[name]) for name in metadata.files))
    lacking = f"{path} lacks {', '.join(absent)}, which its metadata.yaml names"
    if len(files) == len(metadata.files):  # renamed
        metadata, lacking = dataclasses.replace(metadata, problem=lacking), ""
    return OpenBag(metadata, tuple(map(StorageScan, files)), lacking)


def read_bag(path: Path, topic: str = "", joints: Sequence[str] = ()) -> Trajectory:
    """Return the trajectory that a bag holds, whole or torn.

    A sample is a joint state of all joints, with the command that bears the same header stamp if
    there is one. Where several messages or topics tell the joints between them, they are merged.
    Velocities are NaN where none are told.

    Args:
        path: The bag's folder or its only file.
        topic: Which topic of joint states to take, where several tell the same joints.
        joints: Joints that make a sample, if the recorder left no word; empty for all.

    Raises:
        BagError: there is no bag, it cannot be read or is damaged, or its joint states make no
            trajectory.
    """
    return read_recording(path).trajectory(topic, joints)


def read_path(path: Path, topic: str = "", joints: Sequence[str] = ()) -> Trajectory:
    """Return the motion in a bag at the rate at which the robot told of it.

    The samples are among it, each with the mean of the commands that were sent on its decision. A
    bag that holds nothing but samples gives these, with the one command that it knows.

    Args:
        path: The bag's folder or its only file.
        topic: As in `read_bag`.
        joints: As in `read_bag`.

    Raises:
        BagError: as `read_bag`.
    """
    return read_recording(path, full_rate=True).path_taken(topic, joints)


def read_messages(path: Path) -> Iterator[BagMessage]:
    """Yield all messages of a bag, file by file.

    Raises:
        BagError: as `read_recording`.
    """
    for scan in open_bag(path).scans:
        yield from scan.messages(only_joint_states=False)


def messages_digest(path: Path) -> str:
    """Return a digest of all messages of a bag: two copies of one recording have the same.

    Raises:
        BagError: as `read_recording`.
    """
    digest = hashlib.sha256()
    for message in read_messages(path):
        digest.update(f"{message.topic.name} {message.log_time} {len(message.data)}\n".encode())
        digest.update(message.data)
    return digest.hexdigest()


def _is_ros1(bag: OpenBag) -> bool:
    """Whether this is a bag of ROS 1, which has no metadata.yaml."""
    return all(scan.path.suffix == ".bag" for scan in bag.scans)


def _take(
    columns: JointStateColumns, reader: StreamReader, place: int, message: BagMessage
) -> None:
    """Add a message; one that is no JointState is remembered, for it may not be asked for."""
    try:
        read = decode_ros1 if message.topic.encoding == "ros1" else reader.read
        columns.append(place, read(message.data))
    except BagError as error:
        columns.malformed = columns.malformed or f"message {len(columns) + 1}: {error}"
