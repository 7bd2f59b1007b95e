"""Quality of service of every topic, in one place; publisher and subscriber stay compatible."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _profile(depth: int, *, reliable: bool = True, latched: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


JOINT_STATES_PUB = _profile(10)
"""What a robot (or the simulator) publishes joint states with."""

JOINT_STATES_SUB = _profile(10, reliable=False)
"""Best effort accepts both kinds of publisher, and an old state is worth nothing."""

JOINT_COMMAND = _profile(1)
"""Commands: reliable, only the newest counts."""

COMMAND_RECORDING = _profile(5000)
"""How the recorder listens to commands: reliable, and a busy disk must not cost one."""

STATE_RECORDING = _profile(5000, reliable=False)
"""How the recorder listens to joint states: like everybody, but here an old one counts too."""

OBJECT_POSE_PUB = _profile(1, latched=True)
"""Where the object is: the last pose is kept for whoever comes later."""

OBJECT_POSE_SUBS = (_profile(1, latched=True), _profile(10), _profile(10, reliable=False))
"""All three at once, as each publisher's quality allows: a pose that is told only once is repeated
until it is heard, and a camera that does not repeat is heard too."""

CLOCK = _profile(1, reliable=False)
"""/clock as rclpy itself subscribes to it."""

DIAGNOSTICS = _profile(10)
"""/diagnostics and learner/progress."""

LATCHED = _profile(1, latched=True)
"""The last message is kept for whoever comes later."""

TF = _profile(100)
"""/tf, as everybody has it."""
