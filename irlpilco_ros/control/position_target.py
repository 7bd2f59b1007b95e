"""Where the joints of a robot should be that takes positions. No ROS here."""

from __future__ import annotations

from irlpilco_ros.control.motions import Command, Vector


class PositionTarget:
    """The commanded velocities, integrated from where a motion begins.

    It does not follow what is measured, so that a robot that gives way comes back. Where a motion
    is stopped, and not where it ends, the target is where the robot is: it pushes no further.
    """

    def __init__(self) -> None:
        """Begin with no motion."""
        self._last: tuple[Command, Vector] | None = None

    def follow(self, command: Command, measured: Vector) -> Vector:
        """Return the positions (F,) at the command's stamp; its velocities hold from there on.

        Args:
            command: The newest one; the same one again changes nothing.
            measured: Positions of the commanded joints (F,).
        """
        if self._last is None or command.halts:
            positions = measured
        else:
            before, positions = self._last
            positions = positions + before.values * 1e-9 * (command.stamp - before.stamp)
        self._last = None if command.done else (command, positions)
        return positions
