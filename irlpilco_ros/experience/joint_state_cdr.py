"""sensor_msgs/JointState as bytes on the wire and in a bag, without ROS installed."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from irlpilco_ros.experience.errors import BagError

JOINT_STATE = "sensor_msgs/msg/JointState"
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class JointStateMessage:
    """One JointState: a robot's state, or a command to it.

    Attributes:
        stamp: header.stamp [ns].
        names: Joints (n).
        positions: Empty or (n,) [rad].
        velocities: Empty or (n,) [rad/s].
        efforts: Empty or (n,) [N m].
    """

    stamp: int
    names: tuple[str, ...]
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()

    @property
    def command(self) -> tuple[float, ...]:
        """The commanded values: velocities, else efforts."""
        return self.velocities or self.efforts


@cache
def typestore() -> Typestore:
    """Message definitions of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


@cache
def _ros1_typestore() -> Typestore:
    return get_typestore(Stores.ROS1_NOETIC)


@cache
def schema(message_type: str = JOINT_STATE) -> tuple[str, str]:
    """Return a type's definition with all that it depends on (ros2msg), and its RIHS01 hash."""
    text, _ = typestore().generate_msgdef(message_type, ros_version=2)
    return text, typestore().hash_rihs01(message_type)


def decode(data: bytes) -> JointStateMessage:
    """Return the message that CDR bytes hold.

    Raises:
        BagError: the bytes are no JointState.
    """
    return _decode(data, typestore().deserialize_cdr)


def decode_ros1(data: bytes) -> JointStateMessage:
    """Return the message that bytes of ROS 1 hold; errors as `decode`."""
    return _decode(data, _ros1_typestore().deserialize_ros1)


def _decode(data: bytes, deserialise: Callable[[bytes, str], Any]) -> JointStateMessage:
    try:
        message = deserialise(data, JOINT_STATE)
    except Exception as error:  # rosbags raises whatever its unpacking runs into
        raise BagError(f"{len(data)} bytes are no {JOINT_STATE}: {error}") from error
    stamp = message.header.stamp
    return JointStateMessage(
        stamp=int(stamp.sec) * NANOSECONDS + int(stamp.nanosec),
        names=tuple(message.name),
        positions=tuple(message.position.tolist()),
        velocities=tuple(message.velocity.tolist()),
        efforts=tuple(message.effort.tolist()),
    )


def encode(message: JointStateMessage) -> bytes:
    """Return the message as little-endian CDR bytes, exactly as long as it is."""
    types = typestore().types
    seconds, rest = divmod(message.stamp, NANOSECONDS)
    ros_message = types[JOINT_STATE](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest), frame_id=""
        ),
        name=list(message.names),
        position=_floats(message.positions),
        velocity=_floats(message.velocities),
        effort=_floats(message.efforts),
    )
    return bytes(typestore().serialize_cdr(ros_message, JOINT_STATE))


class Reading(NamedTuple):
    """What is read of a JointState while it streams by.

    Attributes:
        stamp: header.stamp [ns].
        names: Joints (n).
        positions: As many as are told [rad]; a view of the bytes.
        velocities: As many as are told [rad/s]; a view of the bytes.
        efforts: As many as are told [N m]; a view of the bytes.
    """

    stamp: int
    names: tuple[str, ...]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    efforts: NDArray[np.float64]

    @property
    def command(self) -> NDArray[np.float64]:
        """The commanded values: velocities, else efforts."""
        return self.velocities if len(self.velocities) else self.efforts


@dataclass(frozen=True)
class _Layout:
    """Where a JointState's fields are, and the bytes that every message of this layout shares."""

    shared: tuple[tuple[int, bytes], ...]
    stamp: struct.Struct
    numbers: str
    positions: tuple[int, int]
    velocities: tuple[int, int]
    efforts: tuple[int, int]
    names: tuple[str, ...]

    def fits(self, data: bytes) -> bool:
        return all(data.startswith(part, offset) for offset, part in self.shared)

    def values(self, data: bytes, place: tuple[int, int]) -> NDArray[np.float64]:
        count, offset = place
        return np.frombuffer(data, self.numbers, count, offset) if count else _NOTHING


class StreamReader:
    """Reads JointStates many times faster than decoding, for streams of them.

    A publisher's messages nearly always name the same joints, so all their bytes but stamp and
    values are compared with those of before, and they are decoded when these are new.
    """

    def __init__(self) -> None:
        self._known: dict[int, _Layout] = {}  # by the length of the message

    def read(self, data: bytes) -> Reading:
        """Return stamp, names and values of a JointState in CDR bytes.

        Raises:
            BagError: the bytes are no JointState.
        """
        layout = self._known.get(len(data))
        if layout is None or not layout.fits(data):
            if len(self._known) > _LAYOUTS:
                self._known.clear()
            layout = self._known[len(data)] = _layout(data, decode(data))
        seconds, rest = layout.stamp.unpack_from(data, _HEADER)
        return Reading(
            seconds * NANOSECONDS + rest,
            layout.names,
            layout.values(data, layout.positions),
            layout.values(data, layout.velocities),
            layout.values(data, layout.efforts),
        )


_HEADER = 4  # bytes that say how the rest is encoded
_AFTER_STAMP = 12
_NOTHING = np.empty(0)
_LAYOUTS = 100  # that are remembered


def _layout(data: bytes, message: JointStateMessage) -> _Layout:
    """Return where a message's fields are: frame_id and names, then three lists of numbers."""
    order = "<" if data[1] & 1 else ">"
    count = struct.Struct(f"{order}I")

    def after_string(start: int) -> int:
        start += -start % 4
        return start + 4 + int(count.unpack_from(data, start)[0])

    offset = after_string(_AFTER_STAMP)
    offset += 4 + -offset % 4
    for _ in message.names:
        offset = after_string(offset)
    shared = [(0, data[:_HEADER]), (_AFTER_STAMP, data[_AFTER_STAMP:offset])]
    places = []
    for values in (message.positions, message.velocities, message.efforts):
        offset += -offset % 4
        shared.append((offset, data[offset : offset + 4]))
        offset += 4
        if values:
            offset += -(offset - _HEADER) % 8
        places.append((len(values), offset))
        offset += 8 * len(values)
    stamp = struct.Struct(f"{order}iI")
    positions, velocities, efforts = places
    return _Layout(
        tuple(shared), stamp, f"{order}f8", positions, velocities, efforts, message.names
    )


def _floats(values: Sequence[float]) -> np.ndarray:
    return np.asarray(values, dtype=np.float64)
