"""A simulated arm whose driver has other habits than our simulators: those of ros2_control.

It tells joint states at 125 Hz, in another order than it takes commands, stamped by this computer's
clock; it takes velocities as a Float64MultiArray, and keeps the last one for ever. Called by
`other_driver/show`, its joints are moved as a person would.

    python tests/other_driver.py            # the six joints of a UR5e
"""

from __future__ import annotations

import sys
import time
from collections import deque

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from irlpilco_ros.ros.runtime import run_node

JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
START = (0.0, -1.57, 1.4, -1.4, -1.57, 0.0)  # [rad]
WAY = (0.5, 0.2, -0.3, 0.15, 0.1, -0.4)  # [rad] there and back, when it is shown
SHOWN = 4.0  # [s]
RATE = 125.0  # [Hz]
DELAY = 4  # states from a command to its effect
LAG = 0.03  # [s] of the servos
GAIN = 0.95  # made of a commanded velocity
NOISE = 1e-4  # [rad]


class OtherDriver(Node):
    """The arm and its driver."""

    def __init__(self):
        super().__init__("other_driver")
        self._rng = np.random.default_rng(0)
        self._positions, self._velocities = np.array(START), np.zeros(len(JOINTS))
        self._commanded = np.zeros(len(JOINTS))
        self._waiting = deque([self._commanded] * DELAY)
        self._shown = None
        self._before = time.monotonic()
        self._states = self.create_publisher(JointState, "joint_states", 10)
        self.create_subscription(Float64MultiArray, "velocity_controller/commands", self._take, 1)
        self.create_service(Trigger, "~/show", self._show)
        self.create_timer(1.0 / RATE, self._step)

    def wind_down(self):
        """Nothing is to be broken off."""

    def shutdown(self):
        """Nothing is to be stopped."""

    def _take(self, message):
        if len(message.data) == len(JOINTS):
            self._commanded = np.array(message.data)

    def _show(self, _, response):
        self._shown = 0.0
        response.success, response.message = True, f"it takes {SHOWN:g} s"
        return response

    def _step(self):
        now = time.monotonic()
        passed, self._before = now - self._before, now  # a busy computer is late; the arm is not
        self._waiting.append(self._commanded)
        wanted = GAIN * self._waiting.popleft()
        if self._shown is not None:
            self._shown += passed
            phase = 2.0 * np.pi * self._shown / SHOWN
            wanted = np.array(WAY) * np.pi / SHOWN * np.sin(phase) * (1.0 - np.cos(phase)) * 1.1
            self._velocities = wanted
            if self._shown >= SHOWN:
                self._shown = None
                print("shown", flush=True)
        share = passed / (passed + LAG)
        self._velocities = self._velocities + share * (wanted - self._velocities)
        self._positions = self._positions + self._velocities * passed
        order = np.argsort(JOINTS)  # as joint_state_broadcaster may tell them
        message = JointState(
            name=[JOINTS[k] for k in order],
            position=(self._positions + NOISE * self._rng.standard_normal(6))[order].tolist(),
            velocity=(self._velocities + 10 * NOISE * self._rng.standard_normal(6))[order].tolist(),
            effort=[float("nan")] * 6,
        )
        message.header.stamp = self.get_clock().now().to_msg()
        self._states.publish(message)


def main():
    return run_node(OtherDriver)


if __name__ == "__main__":
    sys.exit(main())
