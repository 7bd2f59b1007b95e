"""Where the object of a motion was: geometry_msgs/PoseStamped, on the wire and in a bag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irlpilco_ros.experience.bag_reader import read_messages
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS, typestore
from irlpilco_ros.kinematics.rigid_motion import (
    inverse,
    mean_pose,
    pose,
    pose_of_quaternion,
    quaternion_of,
)
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.settings import check, setting

POSE_STAMPED = "geometry_msgs/msg/PoseStamped"

OBJECT_POSE = "object_pose"
"""Last part of the topic's name."""

_UNIT = 0.1
"""By which the length of a quaternion may differ from 1; nobody measures a rotation that badly."""


@dataclass(frozen=True)
class ObjectSettings:
    """Where the object is if nobody says so.

    Raises:
        InvalidSettingError: it is no pose.
    """

    object_pose: tuple[float, ...] = setting(
        (),
        "Pose of the object in the robot's base frame, where nobody publishes object_pose: x, y, z "
        "[m], roll, pitch, yaw [rad]; empty if it is not known.",
    )

    def __post_init__(self) -> None:
        check(self)
        if len(self.object_pose) not in (0, 6):
            raise InvalidSettingError(
                f"ObjectSettings.object_pose has {len(self.object_pose)} values; expected x, y, z "
                "[m], roll, pitch, yaw [rad], or none"
            )

    @property
    def pose(self) -> Array | None:
        """The pose (4, 4), if it is known."""
        return pose(self.object_pose[:3], self.object_pose[3:]) if self.object_pose else None


def shifted(object_pose: Array, x: float, y: float, turn: float) -> Array:
    """Return an object's pose (4, 4) elsewhere in the base frame's horizontal plane.

    Args:
        object_pose: Where it was, (4, 4).
        x: How far it goes [m].
        y: How far it goes [m].
        turn: How far it turns about its own vertical [rad].
    """
    centre = pose(object_pose[:3, 3])
    there = pose(object_pose[:3, 3] + [x, y, 0.0], (0.0, 0.0, turn))
    moved: Array = there @ inverse(centre) @ object_pose
    return moved


def displacement(before: Array, now: Array) -> tuple[float, float, float]:
    """Return how far an object went along x and y [m], and how far it turned about z [rad]."""
    way, turn = (now - before)[:2, 3], (now @ inverse(before))[:3, :3]
    return float(way[0]), float(way[1]), float(np.arctan2(turn[1, 0], turn[0, 0]))


def decode_pose(data: bytes) -> Array:
    """Return the pose (4, 4) that CDR bytes of a PoseStamped hold.

    Raises:
        BagError: they are none, or it is no pose: not finite, or not turned in any way.
    """
    try:
        message: Any = typestore().deserialize_cdr(data, POSE_STAMPED)
    except Exception as error:  # rosbags raises whatever its unpacking runs into
        raise BagError(f"{len(data)} bytes are no {POSE_STAMPED}: {error}") from error
    place, turn = message.pose.position, message.pose.orientation
    position, quaternion = (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)
    length = float(np.linalg.norm(quaternion))
    if not (np.isfinite(position).all() and abs(length - 1.0) <= _UNIT):
        raise BagError(
            f"it is no pose: position {list(position)}, orientation {list(quaternion)}; expected "
            "finite numbers [m] and a quaternion of length 1"
        )
    return pose_of_quaternion(position, quaternion)


def encode_pose(matrix: Array, stamp: int = 0, frame: str = "base") -> bytes:
    """Return a pose (4, 4) with its stamp [ns] as CDR bytes of a PoseStamped."""
    types = typestore().types
    seconds, rest = divmod(stamp, NANOSECONDS)
    x, y, z = map(float, matrix[:3, 3])
    quaternion = dict(zip("xyzw", map(float, quaternion_of(matrix)), strict=True))
    message = types[POSE_STAMPED](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest), frame_id=frame
        ),
        pose=types["geometry_msgs/msg/Pose"](
            position=types["geometry_msgs/msg/Point"](x=x, y=y, z=z),
            orientation=types["geometry_msgs/msg/Quaternion"](**quaternion),
        ),
    )
    return bytes(typestore().serialize_cdr(message, POSE_STAMPED))


def recorded_object_pose(bag: Path) -> Array | None:
    """Return where the object was during a recording, (4, 4); None if the bag does not tell.

    It is the mean of all that was told, for a camera sees it with noise.

    Raises:
        BagError: the bag cannot be read.
    """
    told = [
        decode_pose(message.data)
        for message in read_messages(bag)
        if message.topic.message_type == POSE_STAMPED
        and message.topic.name.rpartition("/")[2] == OBJECT_POSE
    ]
    return mean_pose(np.stack(told)) if told else None


def demonstrated_poses(bags: Sequence[Path], otherwise: Array | None) -> list[Array]:
    """Return where the object was in each of the demonstrations' bags.

    Args:
        bags: Of the demonstrations.
        otherwise: Where it was if a bag does not tell, (4, 4).

    Raises:
        BagError: a bag cannot be read, or nobody knows.
    """
    found = []
    for bag in bags:
        known = recorded_object_pose(bag)
        known = otherwise if known is None else known
        if known is None:
            raise BagError(
                f"where the object was when {bag} was recorded is not known; publish object_pose "
                "while recording, or set object_pose in the robot's file"
            )
        found.append(known)
    return found
