"""What drives each arm joint at every instant: a command, a guiding hand, or its hold."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Indices = NDArray[np.intp]

_HOLD_GAIN = 5.0  # [1/s]: velocity asked for per error of position while holding
_GUIDE_STIFFNESS = 60.0  # [rad/s]: natural frequency of the critically damped guiding hand
_GUIDE_REACH = 0.05  # [rad]: a hand that is further away pulls no harder; approach at 1.5 rad/s


@dataclass(frozen=True)
class Drive:
    """What the joints get during one time step.

    Attributes:
        velocities: (J,) that the servos aim at [rad/s].
        guide_accelerations: (J,) that the guiding hand adds [rad/s^2], 0 where nobody guides.
        guide_velocities: (J,) of the guiding hand [rad/s], 0 where nobody guides.
    """

    velocities: Vector
    guide_accelerations: Vector
    guide_velocities: Vector


class JointServos:
    """Keeps, per joint, the newest command and guide and how long they are valid.

    Time is counted in whole steps of the physics, so that the same calls give the same motion
    bit for bit.
    """

    def __init__(
        self,
        velocity_limit: Vector,
        speed_factor: Vector,
        lag_steps: int,
        timeout_steps: int,
        servo_lag_steps: float = 0.0,
    ) -> None:
        """Make servos that hold.

        Args:
            velocity_limit: (J,) [rad/s]; commands are clipped to it.
            speed_factor: (J,) speed made of a commanded 1 rad/s.
            lag_steps: Steps from a command's arrival to its effect.
            timeout_steps: Steps without a command after which a joint holds its position.
            servo_lag_steps: Time constant, in steps, at which a servo's aim follows the command
                (first order); 0: it aims at the command itself.
        """
        self._limit = velocity_limit
        self._factor = speed_factor
        self._lag = lag_steps
        self._timeout = timeout_steps
        self._share = 1.0 / (1.0 + servo_lag_steps)
        self._zero = np.zeros(len(velocity_limit))
        self.reset()

    def reset(self) -> None:
        """Forget all commands; hold the positions of the next step."""
        joints = len(self._limit)
        self._waiting: deque[tuple[int, Indices, Vector]] = deque()
        self._command = np.zeros(joints)
        self._aim = np.zeros(joints)
        self._command_end = np.zeros(joints, dtype=int)
        self._guide_position = np.zeros(joints)
        self._guide_velocity = np.zeros(joints)
        self._guide_start = np.zeros(joints, dtype=int)
        self._guide_end = np.zeros(joints, dtype=int)
        self._hold_position = np.zeros(joints)
        self._holding = np.zeros(joints, dtype=bool)

    def command(self, step: int, joints: Indices, velocities: Vector) -> None:
        """Take a command at this step; it acts after the lag and until the timeout."""
        limit = self._limit[joints]
        self._waiting.append((step + self._lag, joints, np.clip(velocities, -limit, limit)))

    def guide(self, step: int, joints: Indices, positions: Vector, velocities: Vector) -> None:
        """Take these joints by the hand: now at `positions`, moving on at `velocities`."""
        self._waiting.clear()
        self._command_end[joints] = 0
        self._guide_position[joints] = positions
        self._guide_velocity[joints] = velocities
        self._guide_start[joints] = step
        self._guide_end[joints] = step + self._timeout

    def drive(self, step: int, timestep: float, positions: Vector, velocities: Vector) -> Drive:
        """Return what acts during this step, from the true positions and velocities (J,)."""
        while self._waiting and self._waiting[0][0] <= step:
            _, joints, command = self._waiting.popleft()
            self._command[joints] = command
            self._command_end[joints] = step + self._timeout
            self._guide_end[joints] = 0
        commanded = step < self._command_end
        guided = step < self._guide_end
        self._follow(commanded)
        target = self._aim * self._factor
        moved = commanded | guided
        if moved.all():
            self._holding[:] = False
        else:
            target = np.where(commanded, target, self._hold(moved, positions))
        if not guided.any():
            return Drive(target, self._zero, self._zero)
        elapsed = (step - self._guide_start) * timestep
        ahead = self._guide_position + elapsed * self._guide_velocity - positions
        pull = _GUIDE_STIFFNESS**2 * ahead.clip(-_GUIDE_REACH, _GUIDE_REACH)
        pull += 2.0 * _GUIDE_STIFFNESS * (self._guide_velocity - velocities)
        return Drive(
            velocities=np.where(guided, self._guide_velocity, target),
            guide_accelerations=np.where(guided, pull, 0.0),
            guide_velocities=np.where(guided, self._guide_velocity, 0.0),
        )

    def _follow(self, commanded: NDArray[np.bool_]) -> None:
        """Let the servos' aim follow the command, or zero where nobody commands."""
        if self._share == 1.0:
            self._aim = self._command
            return
        wanted = np.where(commanded, self._command, 0.0)
        self._aim = self._aim + self._share * (wanted - self._aim)

    def _hold(self, moved: NDArray[np.bool_], positions: Vector) -> Vector:
        """Return the velocities that keep the joints nobody moves where they were left."""
        starting = ~moved & ~self._holding
        self._hold_position[starting] = positions[starting]
        self._holding = ~moved
        correction = _HOLD_GAIN * (self._hold_position - positions)
        return correction.clip(-self._limit, self._limit)
