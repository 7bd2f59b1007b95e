"""The joints of the simulated Baxter and the order in which the real one names them."""

from __future__ import annotations

ARM_JOINTS: tuple[str, ...] = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
)
"""The 14 joints that can be commanded, from the shoulders outwards, left arm first."""

PUBLISHED_JOINTS: tuple[str, ...] = tuple(sorted((*ARM_JOINTS, "head_nod", "head_pan", "torso_t0")))
"""The 17 names of a real Baxter's joint states, in alphabetical order."""

GRIPPER_JOINTS: tuple[str, ...] = ("l_gripper_l_finger_joint", "r_gripper_l_finger_joint")
"""Grippers come in messages of their own, one joint each."""
