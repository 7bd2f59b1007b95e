"""Velocity servos of the arm joints, as stiff or as soft as the robot to be imitated."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ServoPreset:
    """How the joints follow a commanded velocity: torque = gain (command - velocity), later by lag.

    Attributes:
        shoulder: Gain of s0 and s1 [Nm s/rad].
        elbow: Gain of e0 and e1 [Nm s/rad].
        wrist: Gain of w0, w1 and w2 [Nm s/rad].
        command_lag: Time from a command's arrival to its effect [s].
        servo_lag: Time constant at which the servos' aim follows the command (first order) [s].
    """

    shoulder: float
    elbow: float
    wrist: float
    command_lag: float
    servo_lag: float = 0.0

    def gain(self, joint: str) -> float:
        """Return the gain [Nm s/rad] of a joint such as "left_s0"."""
        groups = {"s": self.shoulder, "e": self.elbow, "w": self.wrist}
        return groups[joint.split("_")[1][0]]


SERVO_PRESETS = {
    "stiff": ServoPreset(shoulder=60.0, elbow=40.0, wrist=15.0, command_lag=0.0),
    "compliant": ServoPreset(shoulder=25.0, elbow=15.0, wrist=5.0, command_lag=0.05),
    "delayed": ServoPreset(shoulder=25.0, elbow=15.0, wrist=5.0, command_lag=0.1, servo_lag=0.3),
}
"""stiff does nearly what it is told; compliant is the softness that elastic joints have; delayed
runs 0.4 s behind at constant speed, as has been measured on a Baxter."""
