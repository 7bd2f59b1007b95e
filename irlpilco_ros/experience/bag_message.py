"""One message in a bag, as raw bytes, and its topic."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

from irlpilco_ros.experience.joint_state_cdr import JOINT_STATE, schema

CUSTOM_RECORD = "irlpilco_ros"
"""Name of the MCAP metadata record with what the recorder knew from the start."""

FULL_RATE = "/full_rate"
"""What the name of a topic ends with in a bag that holds all its messages, not samples alone."""

JOINTS = "joints"
"""Key of the recorded joints in a bag's custom data."""


def joints_entry(joints: Sequence[str]) -> dict[str, str]:
    """Return the recorded joints as custom data: separated by commas, or as a list in JSON.

    JSON where a name holds a comma itself.
    """
    joined = ",".join(joints)
    plain = len(joined.split(",")) == len(joints) and not joined.startswith("[")
    return {JOINTS: joined if plain else json.dumps(list(joints))}


def recorded_joints(custom: Mapping[str, str]) -> tuple[str, ...]:
    """Return the joints that a bag's custom data name, none if they name none."""
    entry = custom.get(JOINTS, "")
    if entry.startswith("["):
        try:
            names = json.loads(entry)
        except ValueError:
            return ()
        return tuple(names) if all(isinstance(name, str) for name in names) else ()
    return tuple(entry.split(",")) if entry else ()


@dataclass(frozen=True)
class BagTopic:
    """A topic of a bag.

    Attributes:
        name: Resolved name, such as /robot/joint_states.
        message_type: Such as sensor_msgs/msg/JointState.
        definition: The type's definition with all that it depends on (ros2msg).
        type_hash: The type's hash (RIHS01), empty if unknown.
        encoding: How its messages are written: cdr, or ros1.
        qos_profiles: Quality of service that its publishers offered, as rosbag2 writes it.
        qos_text: The same as YAML, where it was read from a bag.
    """

    name: str
    message_type: str
    definition: str = field(repr=False)
    type_hash: str = field(repr=False)
    encoding: str = field(default="cdr", repr=False)
    qos_profiles: tuple[Mapping[str, Any], ...] = field(default=(), compare=False, repr=False)
    qos_text: str = field(default="", compare=False, repr=False)

    @property
    def at_full_rate(self) -> Self:
        """The topic that holds all messages of this one, beside its samples."""
        return replace(self, name=self.name + FULL_RATE)

    @property
    def is_full_rate(self) -> bool:
        """Whether it holds all messages of another topic."""
        return self.name.endswith(FULL_RATE)

    @classmethod
    def joint_state(cls, name: str, qos_profiles: Sequence[Mapping[str, Any]] = ()) -> Self:
        """Return a topic of sensor_msgs/JointState."""
        definition, type_hash = schema(JOINT_STATE)
        return cls(name, JOINT_STATE, definition, type_hash, qos_profiles=tuple(qos_profiles))


@dataclass(frozen=True)
class BagMessage:
    """A message of a bag.

    Attributes:
        topic: Its topic.
        data: The bytes that came over the wire (CDR).
        log_time: When it was received [ns], wall clock.
        publish_time: When it was sent [ns], wall clock of the sender.
    """

    topic: BagTopic
    data: bytes = field(repr=False)
    log_time: int
    publish_time: int
