"""sensor_msgs/JointState as bytes on the wire and in a bag, without ROS installed."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
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
def schema(message_type: str = JOINT_STATE) -> tuple[str, str]:
    """Return a type's definition with all that it depends on (ros2msg), and its RIHS01 hash."""
    text, _ = typestore().generate_msgdef(message_type, ros_version=2)
    return text, typestore().hash_rihs01(message_type)


def decode(data: bytes) -> JointStateMessage:
    """Return the message that CDR bytes hold.

    Raises:
        BagError: the bytes are no JointState.
    """
    try:
        message: Any = typestore().deserialize_cdr(data, JOINT_STATE)
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


class HeaderReader:
    """Reads stamp and names only: forty times faster than decoding, for streams of states.

    A publisher's messages nearly always name the same joints, so their bytes are compared with
    those of before, and are decoded when they are new.
    """

    def __init__(self) -> None:
        self._known: dict[int, tuple[bytes, tuple[str, ...]]] = {}

    def read(self, data: bytes) -> tuple[int, tuple[str, ...]]:
        """Return header.stamp [ns] and the names of a JointState in CDR bytes.

        Raises:
            BagError: the bytes are no JointState.
        """
        section, names = self._known.get(len(data), (b"", ()))
        if not section or data[_AFTER_STAMP : _AFTER_STAMP + len(section)] != section:
            names = decode(data).names
            self._known[len(data)] = (data[_AFTER_STAMP : _end_of_names(data)], names)
        seconds, rest = (_STAMP_LITTLE if data[1] & 1 else _STAMP_BIG).unpack_from(data, 4)
        return seconds * NANOSECONDS + rest, names


_STAMP_LITTLE, _STAMP_BIG = struct.Struct("<iI"), struct.Struct(">iI")
_AFTER_STAMP = 12


def _end_of_names(data: bytes) -> int:
    """Return where the names end: after frame_id, their number, and each with its length."""
    count = struct.Struct("<I" if data[1] & 1 else ">I")

    def after_string(start: int) -> int:
        start += -start % 4
        return start + 4 + int(count.unpack_from(data, start)[0])

    offset = after_string(_AFTER_STAMP)
    offset += -offset % 4
    (names,) = count.unpack_from(data, offset)
    offset += 4
    for _ in range(names):
        offset = after_string(offset)
    return offset


def _floats(values: Sequence[float]) -> np.ndarray:
    return np.asarray(values, dtype=np.float64)
