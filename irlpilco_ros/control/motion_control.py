"""From joint states to commands: one motion at a time, watched over. No ROS here.

The node hands in messages and clock readings and sends what it gets back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.control.acceleration_limit import AccelerationLimit
from irlpilco_ros.control.approach import Approach
from irlpilco_ros.control.controller_settings import ControllerSettings, changed_guards
from irlpilco_ros.control.joint_state_tracker import (
    RESTART,
    JointReading,
    JointStateTracker,
    MalformedJointStateError,
)
from irlpilco_ros.control.liveness import Liveness
from irlpilco_ros.control.motions import Command, Motion, MotionStoppedError, Vector
from irlpilco_ros.control.safety import (
    check_command,
    check_efforts,
    check_positions,
    check_reading,
)
from irlpilco_ros.control.stall_guard import StallGuard
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import IrlPilcoError

_OWN_HOLD_UP = 0.03
"""A gap between two looks of the watch that shows that this very process was held up [s]."""


_SPREADS = 5.0  # standard deviations of a start that is known to vary


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
        settings: What is in force; `change` changes it.
    """

    def __init__(self, robot: RobotSettings, settings: ControllerSettings) -> None:
        """Control this robot; nothing moves yet."""
        self.robot = robot
        self.settings = settings
        self._tracker = JointStateTracker(robot.joints)
        self._motion: Motion | None = None
        self._last: Command | None = None
        self._finish: Callable[[Outcome], None] | None = None
        self._liveness = Liveness(self._tracker)
        self._acceleration = AccelerationLimit(robot.acceleration_limits)
        self._malformed = ""
        self._answered: int | None = None
        self._watched = 0.0
        self._stall_guard = StallGuard(robot.roles.commanded)
        self._holding = np.zeros(len(robot.roles.commanded))

    @property
    def last(self) -> Command | None:
        """The motion's last command, or None before there is one."""
        return self._last

    @property
    def motion(self) -> Motion | None:
        """What is going on, or None when idle."""
        return self._motion

    def change(self, settings: ControllerSettings) -> Command | None:
        """Take other settings; return a zero command if that stops the robot.

        A motion ends when what guards it changes, and when the controller is disabled.
        """
        before, self.settings = self.settings, settings
        if before.enabled and not settings.enabled:
            return self.stop("the controller was disabled") or self.zero()
        changes = changed_guards(before, settings)
        return self.stop(f"what guards it was changed under way: {changes}") if changes else None

    def check_start(self) -> None:
        """Check that a trial would begin where the policy starts, as far as that is known.

        Raises:
            MotionRefusedError: names the joint that is farthest from there, and how far.
        """
        start, reading = self.settings.start_position, self._tracker.reading()
        if self._motion is not None or not start or reading is None:
            return  # busy is the better reason, and `start` gives it
        distance = np.abs(reading.positions - np.array(start))
        tolerance = self.settings.trial_start_tolerance * self.robot.tolerance_share
        tolerance += _SPREADS * self.robot.start_spread
        joint = int((distance / tolerance).argmax())
        if distance[joint] > tolerance[joint]:
            unit = self.robot.units[joint]
            raise MotionRefusedError(
                f"joint {self.robot.joints[joint]} is {distance[joint]:.4f} {unit} from the "
                f"policy's start, {start[joint]:g} {unit}; expected at most "
                f"{tolerance[joint]:g} {unit} (trial_start_tolerance): call "
                "controller/move_to_start first"
            )

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
        self._motion, self._finish, self._last = motion, finish, None
        self._acceleration = AccelerationLimit(self.robot.acceleration_limits)
        stamp = self._tracker.stamp
        assert stamp is not None  # it is ready
        self._liveness.note_command(now, stamp)
        self._stall_guard = StallGuard(self.robot.roles.commanded)

    def note_clock(self, time: int) -> None:
        """Take in a simulator's /clock [ns]: how it says that its time stands still."""
        self._liveness.note_clock(time)

    def take(self, message: JointStateMessage, now: float) -> Command | None:
        """Take in a joint state that arrived `now`; return what to send, or None when idle.

        Every state is answered once: a simulation in lockstep repeats a state until it is
        answered, and a robot may send a stamp twice. Its values are checked every time.
        """
        if not set(message.names) & set(self.robot.joints):
            return None  # a gripper's own message is no state
        try:
            is_new = self._tracker.update(message, now)
        except MalformedJointStateError as error:
            self._malformed = str(error)
            return self.stop(self._malformed)
        self._malformed = ""
        reading = self._tracker.reading()
        if is_new:
            self._answered = None
        if self._motion is None or reading is None:
            return None
        try:
            self._check(reading)
            if reading.stamp == self._answered:
                return None
            self._answered = reading.stamp
            self._check_presence(reading.stamp, now)
            command = self._limited(self._motion.command(reading), reading)
            check_command(self.robot, self.settings.position_margin, reading, command.values)
            self._check_stall(reading, command)
        except MotionStoppedError as error:
            return self.stop(str(error))
        self._liveness.note_command(now, reading.stamp)
        self._last = None if command.done else command
        if command.done:
            self._end(Outcome(True, self._motion.summary()))
        return command

    def watch(self, now: float) -> Command | None:
        """Stop the motion if nothing new comes of a joint; call it every 10 ms.

        Take in what has come meanwhile first. After a hold-up of this very process there may be
        more under way, so that the next look decides.
        """
        was_held_up = now - self._watched > _OWN_HOLD_UP
        self._watched = now
        if self._motion is None or was_held_up:
            return None
        silence = self.silence(now)
        return self.stop(silence) if silence else None

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
        zeros = np.zeros(len(self.robot.roles.commanded))
        return Command(stamp, zeros, done=True, halts=True)

    @property
    def commanded_positions(self) -> Vector | None:
        """Newest positions of the commanded joints (F,); None before all are known."""
        reading = self._tracker.reading()
        return None if reading is None else reading.positions[self.robot.roles.commanded_columns]

    def silence(self, now: float) -> str:
        """Say which joints are missing, silent or stuck [steady clock, s]; empty if none is."""
        silence = self._liveness.silence(
            now, self.settings.state_timeout, is_moving=self._motion is not None
        )
        return f"{silence}; {self._malformed}" if silence and self._malformed else silence

    def _limited(self, command: Command, reading: JointReading) -> Command:
        """Return the command within the acceleration limit; a motion ends when it has braked."""
        values = self._acceleration.limited(reading.stamp, command.values)
        if np.array_equal(values, command.values):
            return command
        return Command(command.stamp, values)

    def _check_ready(self, now: float) -> None:
        if not self.settings.enabled:
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
            self._check(reading)
        except MotionStoppedError as error:
            raise MotionRefusedError(str(error)) from error

    def _check(self, reading: JointReading) -> None:
        if self._motion is not None and self._tracker.ran_back >= RESTART:
            raise MotionStoppedError(
                f"joint-state stamps ran back by {self._tracker.ran_back:.3f} s: was the "
                "simulation, or the robot's clock, reset?"
            )
        check_reading(self.robot, reading)
        check_positions(self.robot, self.settings.position_margin, reading)
        check_efforts(self.robot, reading)

    def _check_presence(self, stamp: int, now: float) -> None:
        gap, timeout = self._liveness.without_command(now, stamp), self.settings.command_timeout
        if gap > timeout:
            raise MotionStoppedError(
                f"no command went out for {gap:.3f} s, and after command_timeout = {timeout:g} s "
                "the robot halts by itself: was the controller, or its computer, held up?"
            )

    def _check_stall(self, reading: JointReading, command: Command) -> None:
        assert self._motion is not None  # it has just decided
        if self.robot.command_interface != "velocity":
            return  # an effort that holds is no speed
        if self.settings.position_margin < 0.0 and self._motion.may_push:
            return
        positions = reading.positions[self.robot.roles.commanded_columns]
        if isinstance(self._motion, Approach):
            self._holding = self._motion.holding  # a trial that follows needs it as well
        speeds = command.values - self._holding
        self._stall_guard.check(reading.stamp, positions, speeds, self.settings.stall_timeout)

    def _end(self, outcome: Outcome) -> None:
        finish = self._finish
        self._motion, self._finish = None, None
        if finish is not None:
            finish(outcome)
