"""From joint states to commands: one motion at a time, watched over. No ROS here.

The node hands in messages and clock readings and sends what it gets back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.joint_state_tracker import JointStateTracker, MalformedJointStateError
from irlpilco_ros.control.motions import Command, Motion, MotionStoppedError
from irlpilco_ros.control.safety import check_command, check_reading
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import IrlPilcoError


class MotionRefusedError(IrlPilcoError):
    """A motion cannot start now; the message says why."""


@dataclass(frozen=True)
class Outcome:
    """How a motion ended: `message` is its summary, or the reason why it was stopped."""

    succeeded: bool
    message: str


class MotionControl:
    """Runs one motion at a time and stops it for good reason.

    Attributes:
        settings: May be replaced at any time.
        enabled: Whether motions may start.
    """

    def __init__(self, robot: RobotSettings, settings: ControllerSettings) -> None:
        """Control this robot; nothing moves yet."""
        self.robot = robot
        self.settings = settings
        self.enabled = True
        self._tracker = JointStateTracker(robot.joints)
        self._motion: Motion | None = None
        self._finish: Callable[[Outcome], None] | None = None
        self._answered: int | None = None
        self._latest: int | None = None
        self._was_silent = False

    @property
    def motion(self) -> Motion | None:
        """What is going on, or None when idle."""
        return self._motion

    def start(self, motion: Motion, now: float, finish: Callable[[Outcome], None]) -> None:
        """Begin a motion.

        Args:
            motion: The motion.
            now: Steady clock [s].
            finish: Called once, with the outcome.

        Raises:
            MotionRefusedError: disabled, busy, or the joint states are missing, old or not finite.
        """
        self._check_ready(now)
        self._motion, self._finish = motion, finish
        self._latest = None
        self._was_silent = False

    def take(self, message: JointStateMessage, now: float) -> Command | None:
        """Take in a joint state that arrived `now`; return what to send, or None when idle.

        Every stamp is answered once: a simulation in lockstep repeats a state until it is
        answered, and a robot may send a stamp twice.
        """
        if not set(message.names) & set(self.robot.joints):
            return None  # a gripper's own message is no state
        try:
            self._tracker.update(message, now)
        except MalformedJointStateError as error:
            return self.stop(str(error))
        if message.stamp == self._answered:
            return None
        self._answered = None
        reading = self._tracker.reading()
        if self._motion is None or reading is None:
            return None
        self._answered = reading.stamp
        try:
            self._check_order(reading.stamp)
            check_reading(self.robot, reading)
            command = self._motion.command(reading)
            check_command(self.robot, self.settings.position_margin, reading, command.values)
        except MotionStoppedError as error:
            return self.stop(str(error))
        if command.done:
            self._end(Outcome(True, self._motion.summary()))
        return command

    def watch(self, now: float) -> Command | None:
        """Stop the motion if joint states have gone silent; call it every few milliseconds.

        Silence must be seen twice: after a hold-up of this very process the first look comes
        before the messages that have been waiting in the meantime.
        """
        if self._motion is None:
            return None
        silent = self._tracker.silent(now, self.settings.state_timeout)
        was_silent, self._was_silent = self._was_silent, bool(silent)
        if not (silent and was_silent):
            return None
        return self.stop(self._silence(silent))

    def stop(self, reason: str) -> Command | None:
        """End the motion for this reason; return the zero command to send, None when idle."""
        if self._motion is None:
            return None
        self._end(Outcome(False, f"{self._motion.name} stopped: {reason}"))
        return self.zero()

    def zero(self) -> Command:
        """Return a command that stops the robot, stamped with the newest state."""
        reading = self._tracker.reading()
        stamp = 0 if reading is None else reading.stamp
        return Command(stamp, np.zeros(len(self.robot.roles.commanded)), done=True)

    def silence(self, now: float) -> str:
        """Say which joints are missing or silent [steady clock, s]; empty if none is."""
        silent = self._tracker.silent(now, self.settings.state_timeout)
        return self._silence(silent) if silent else ""

    def _check_ready(self, now: float) -> None:
        if not self.enabled:
            raise MotionRefusedError("the controller is disabled; enable it with controller/enable")
        if self._motion is not None:
            raise MotionRefusedError(
                f"busy: {self._motion.name} is going on; controller/stop ends it"
            )
        silence = self.silence(now)
        if silence:
            raise MotionRefusedError(silence)
        reading = self._tracker.reading()
        assert reading is not None  # nothing is missing
        try:
            check_reading(self.robot, reading)
        except MotionStoppedError as error:
            raise MotionRefusedError(str(error)) from error

    def _check_order(self, stamp: int) -> None:
        latest, self._latest = self._latest, stamp
        back = 0.0 if latest is None else (latest - stamp) * 1e-9
        if back > self.settings.state_timeout:
            raise MotionStoppedError(
                f"joint-state stamps ran back by {back:.3f} s: was the simulation reset?"
            )

    def _silence(self, silent: tuple[str, ...]) -> str:
        missing = self._tracker.missing()
        if missing:
            return f"no joint state yet of: {', '.join(missing)}"
        return f"no joint state for {self.settings.state_timeout:g} s of: {', '.join(silent)}"

    def _end(self, outcome: Outcome) -> None:
        finish = self._finish
        self._motion, self._finish = None, None
        if finish is not None:
            finish(outcome)
