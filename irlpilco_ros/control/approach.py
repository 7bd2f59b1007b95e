"""The way to the start, by velocities alone, on a robot whose servos are late, weak or drift.

The robot moves and looks in turn: a smooth way from standing to standing, a wait until all that
was commanded has come to its effect, and a look at where it stands and how fast it slides. What
was commanded and what came of it say what each joint makes of its commands. So a delay costs
waiting, never an overshoot, and whoever drifts is held. No ROS here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.joint_response import JointResponse
from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.control.lateness import Lateness
from irlpilco_ros.control.look import Look, LookTaker
from irlpilco_ros.control.motions import Command, MotionStoppedError
from irlpilco_ros.control.rest_to_rest import RestToRest

Vector = NDArray[np.float64]

_CAUTION = 0.7  # of the distance, as long as a joint may be a third faster than it is told
_OVERSHOOT = 0.01  # [rad] that may be risked
_CERTAIN = 3.0  # standard deviations
_LEAST_SPEED = 0.2  # of the limit, for a joint that needs nearly all of it to be held
_HELD = 0.008  # [rad/s]: a drift that changes the command by more is looked at before moving on
_HELD_LOOKS = 3  # one after the other
_HOLD_WAIT = 0.6  # [s] longer, for a servo that lags
_PATIENCE = 4  # looks without progress
_PROGRESS = 0.8  # of the best distance before
_BLOCKED = 0.01  # [rad]: nearer than this it is noise or friction that keeps a joint away


class Approach:
    """Moves straight (in joint space) to the start and waits for standstill."""

    name = "move to start"
    may_push = False

    def __init__(
        self,
        joints: tuple[str, ...],
        goal: Vector,
        velocity_limit: Vector,
        settings: ControllerSettings,
    ) -> None:
        """Move these joints (J) to the goal (J,) [rad], never above velocity_limit (J,) [rad/s]."""
        self._joints = joints
        self._goal = goal
        self._limit = np.minimum(velocity_limit, settings.approach_speed)
        self._settings = settings
        self._lateness = Lateness()
        self._response = JointResponse(len(joints))
        self._taker = LookTaker()
        self._hold = np.zeros(len(joints))
        self._way: RestToRest | None = RestToRest(self._hold, 0.0, 0.0)
        self._way_begin = 0.0
        self._least_wait = settings.approach_delay
        self._gone = self._hold
        self._begin: int | None = None
        self._elapsed = 0.0
        self._last = Command(0, self._hold)
        self._commanded = self._hold
        self._error = np.full(len(joints), np.inf)
        self._best = np.inf
        self._in_vain = 0
        self._held_looks = 0

    @property
    def holding(self) -> Vector:
        """What must be commanded (J,) [rad/s] merely to hold the joints."""
        return self._hold

    def command(self, reading: JointReading) -> Command:
        """Return the next velocities; zero and done once the robot stands at the start.

        Raises:
            MotionStoppedError: it is not there in time, or comes no nearer.
        """
        if self._begin is None:
            self._begin = reading.stamp
        before, self._elapsed = self._elapsed, (reading.stamp - self._begin) * 1e-9
        self._commanded = self._commanded + (self._elapsed - before) * (
            self._last.values - self._hold
        )
        self._last = self._next(reading)
        return self._last

    def _next(self, reading: JointReading) -> Command:
        if self._way is not None:
            self._lateness.take(self._elapsed, reading.positions, self._commanded)
            into = self._elapsed - self._way_begin
            if into < self._way.duration:
                return self._at_speed(reading, self._way.velocities(into) + self._hold)
            waited = into - self._way.duration
            if waited >= self._least_wait and waited >= self._lateness.settling():
                self._taker.begin()
                self._way = None
        look = None
        if self._way is None:
            look = self._taker.take(self._elapsed, reading.positions)
        if look is None:
            self._check_time(reading)
            return self._at_speed(reading, self._hold)
        self._error = self._goal - look.position
        if self._is_there(look):
            return Command(reading.stamp, np.zeros_like(self._error), done=True)
        self._check_time(reading)
        self._plan(look)
        return self._at_speed(reading, self._hold)

    def summary(self) -> str:
        """Say how near the robot is."""
        return f"at the start after {self._elapsed:.2f} s: {self._farthest()}"

    def _at_speed(self, reading: JointReading, velocities: Vector) -> Command:
        return Command(reading.stamp, velocities.clip(-self._limit, self._limit))

    def _is_there(self, look: Look) -> bool:
        is_near = np.abs(self._error) <= self._settings.start_tolerance
        is_slow = np.abs(look.speed) <= self._settings.start_speed_tolerance
        return bool((is_near & is_slow).all())

    def _plan(self, look: Look) -> None:
        """Learn from a look, and decide on the next way."""
        response = self._response
        drift = response.learn(look, self._gone, self._lateness.remainder)
        self._hold = response.holding.clip(-self._limit, self._limit)
        way, self._least_wait = np.zeros_like(self._hold), self._settings.approach_delay
        drifts = bool((np.abs(response.held) > _HELD).any())
        self._held_looks = self._held_looks + 1 if drifts else 0
        if not drifts or self._held_looks > _HELD_LOOKS:
            self._check_progress()
            risk = _CERTAIN * response.gain_deviation * np.abs(self._error)
            share = 1.0 if bool((risk <= _OVERSHOOT).all()) else _CAUTION
            late = self._elapsed - look.time + self._lateness.mean
            way = share * (self._error - drift * late) / response.gain
        else:  # a drift that is not held yet would add up over a long way
            self._least_wait += _HOLD_WAIT
        room = np.maximum(self._limit - np.abs(self._hold), _LEAST_SPEED * self._limit)
        acceleration = self._settings.approach_acceleration
        self._way = RestToRest.within(way, room, acceleration)
        self._way_begin, self._gone = self._elapsed, way
        self._lateness.begin(way, float(self._limit.max()))

    def _check_time(self, reading: JointReading) -> None:
        settings = self._settings
        if self._elapsed <= settings.approach_timeout:
            return
        self._error = self._goal - reading.positions
        raise MotionStoppedError(
            f"not at the start after {settings.approach_timeout:g} s: {self._farthest()}, "
            f"tolerance {settings.start_tolerance:g} rad; {self._seen()}"
        )

    def _check_progress(self) -> None:
        """Stop where moving on would only push."""
        distance = float(np.abs(self._error).max())
        has_progress = distance < _PROGRESS * self._best
        self._best = min(self._best, distance)
        self._in_vain = 0 if has_progress else self._in_vain + 1
        if self._in_vain >= _PATIENCE and distance > _BLOCKED:
            raise MotionStoppedError(
                f"comes no nearer to the start: {self._farthest()}, tolerance "
                f"{self._settings.start_tolerance:g} rad; {self._seen()}"
            )

    def _seen(self) -> str:
        joint = int(np.abs(self._error).argmax())
        return (
            f"it makes {self._response.gain[joint]:.2f} of what it is commanded and needs "
            f"{self._response.holding[joint]:.4f} rad/s to be held: is the robot blocked, or its "
            "servo too weak for its load?"
        )

    def _farthest(self) -> str:
        joint = int(np.abs(self._error).argmax())
        return f"{self._joints[joint]} is farthest, {self._error[joint]:.4f} rad away"
