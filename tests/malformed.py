"""JointStates that are none: payloads as a broken or malicious sender may put on the wire."""

from __future__ import annotations

import struct

import numpy as np

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode


def malformed_payloads(joints: tuple[str, ...], count: int = 70, seed: int = 0) -> list[bytes]:
    """Return payloads that are truncated, garbage, or lie about lengths."""
    random = np.random.default_rng(seed)
    zeros = (0.0,) * len(joints)
    whole = encode(JointStateMessage(1_000_000_000, joints, zeros, zeros, zeros))
    payloads = [b"\x00\x01\x00\x00", whole[:9], whole[:20], whole[:-3]]
    for offset in (12, 20):  # the length of frame_id and the number of names
        for length in (0x7FFFFFFF, 0xFFFFFFFF, 10_000):
            payloads.append(whole[:offset] + struct.pack("<I", length) + whole[offset + 4 :])
    while len(payloads) < count:
        kind = len(payloads) % 3
        if kind == 0:
            payloads.append(whole[: int(random.integers(4, len(whole)))])
        elif kind == 1:
            payloads.append(b"\x00\x01\x00\x00" + random.bytes(int(random.integers(1, 400))))
        else:
            cut = int(random.integers(12, len(whole)))
            payloads.append(whole[:cut] + random.bytes(len(whole) - cut))
    return payloads


def unequal_lists(joints: tuple[str, ...]) -> list[JointStateMessage]:
    """Return messages whose lists differ in length."""
    zeros = (0.0,) * len(joints)
    return [
        JointStateMessage(1, joints, zeros[:-1], zeros),
        JointStateMessage(1, joints, zeros, zeros[:-1]),
        JointStateMessage(1, joints, (), zeros),
        JointStateMessage(1, joints[:1], zeros, zeros),
    ]
