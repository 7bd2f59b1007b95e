"""The smallest robot: integrates its commands exactly, and misbehaves when asked to.

In lockstep it waits for the answer to each state, and says on /clock that its time stands still.
It lives in the test's own node and publishes joint states from a thread.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable

import numpy as np
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import CLOCK, COMMAND_RECORDING, JOINT_STATES_PUB

STEP = 0.01  # [s] of message time from state to state
_BEGINNINGS = itertools.count(5_000_000_000, 1_000_000_000_000)  # a controller outlives its robots


class FakeRobot:
    """Publishes states STEP apart in message time, every `wall_step` [s] of wall time.

    Attributes:
        positions: joint -> [rad].
        velocities: joint -> [rad/s]: what was last commanded.
        commands: every joint_command received.
        states: (stamp [ns], positions) of every state published.
        distort: gets each message before it goes out and may change it.
        is_silent: publish nothing, while time goes on.
        is_deaf: take no command.
        heard: when each command came [s, steady].
    """

    def __init__(
        self,
        ros,
        joints,
        positions=None,
        wall_step=0.002,
        lockstep=False,
        topic="",
        listeners=1,
    ):
        self.joints = list(joints)
        self.positions = dict(zip(joints, positions or [0.0] * len(joints), strict=True))
        self.velocities = dict.fromkeys(joints, 0.0)
        self.commands: list[JointState] = []
        self.heard: list[float] = []
        self.states: list[tuple[int, dict[str, float]]] = []
        self.stamp = next(_BEGINNINGS)
        self.distort: Callable[[JointState], None] = lambda message: None
        self.is_silent = False
        self.is_deaf = False
        self.wall_step = wall_step
        self._lockstep = lockstep
        self._answer = threading.Event()
        self._end = threading.Event()
        ros.node.create_subscription(
            JointState, f"{topic}joint_command", self._take, COMMAND_RECORDING
        )
        self._publisher = ros.publisher(
            JointState, f"{topic}joint_states", JOINT_STATES_PUB, subscribers=listeners
        )
        self._clock = ros.publisher(Clock, "/clock", CLOCK) if lockstep else None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()

    def vector(self, quantity: str) -> np.ndarray:
        return np.array([getattr(self, quantity)[joint] for joint in self.joints])

    def wait_for_state(self):
        """Return right after the next state has been published."""
        count = len(self.states)
        while len(self.states) == count:
            time.sleep(0.0005)

    def _take(self, message):
        if self.is_deaf:
            return
        self.heard.append(time.monotonic())
        self.commands.append(message)
        self.velocities.update(zip(message.name, message.velocity, strict=False))
        self._answer.set()

    def _run(self):
        while not self._end.is_set():
            began = time.monotonic()
            if not self.is_silent:
                self._publish()
            if self._lockstep and not self._answer.wait(0.05):
                continue
            self._answer.clear()
            self._advance()
            self._end.wait(max(0.0, self.wall_step - (time.monotonic() - began)))

    def _advance(self):
        for joint in self.joints:
            self.positions[joint] += self.velocities[joint] * STEP
        self.stamp += round(STEP * 1e9)

    def _publish(self):
        names = sorted(self.joints, reverse=True)  # another order than the controller's
        message = JointState(
            name=["head", *names],
            position=[0.0, *(self.positions[name] for name in names)],
            velocity=[0.0, *(self.velocities[name] for name in names)],
        )
        message.header.stamp = time_message(self.stamp)
        self.states.append((self.stamp, dict(self.positions)))
        if self._clock is not None:
            self._clock.publish(Clock(clock=message.header.stamp))
        self.distort(message)
        self._publisher.publish(message)
