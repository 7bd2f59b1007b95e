"""Whether the robot's joint states go on, and whether commands do. No ROS here.

All is counted on a steady clock. A simulation in lockstep stands still on purpose until it is
answered; it says so itself: its /clock stands at the newest joint state. Then what has passed is
counted in the simulation's time, and the steady clock bounds the whole.
"""

from __future__ import annotations

from irlpilco_ros.control.joint_state_tracker import JointStateTracker

LONGEST_STANDSTILL = 5.0
"""How long a simulation may stand still in time before a motion ends [steady clock, s]."""

# The clock and the state of one instant reach us one after the other; and where messages come
# faster than this computer takes them, some of the clock's are lost.
_AHEAD, _LOST = 20_000_000, 100_000_000  # [ns]


class Liveness:
    """Judges how long ago a joint state, or a command, was."""

    def __init__(self, tracker: JointStateTracker) -> None:
        """Judge the joint states that this tracker follows."""
        self._tracker = tracker
        self._clock: int | None = None
        self._sent = (0.0, 0)

    def note_clock(self, time: int) -> None:
        """Take in a simulator's /clock [ns]."""
        self._clock = time

    def note_command(self, now: float, stamp: int) -> None:
        """Take in that a command goes out `now` [s], on the state of this stamp [ns]."""
        self._sent = (now, stamp)

    def without_command(self, now: float, stamp: int) -> float:
        """Return for how long no command went out [s], up to a state of this stamp [ns]."""
        then, stamp_then = self._sent
        return (stamp - stamp_then) * 1e-9 if self._is_simulated() else now - then

    def silence(self, now: float, timeout: float, is_moving: bool) -> str:
        """Say which joints are missing, silent or stuck since `timeout` [s]; empty if none is.

        Without a motion a simulation may stand still as long as it likes.
        """
        tracker = self._tracker
        missing = tracker.missing()
        if missing:
            return f"no joint state yet of: {', '.join(missing)}"
        is_waiting = False
        if self._is_simulated():
            assert self._clock is not None  # else nothing is simulated
            behind = tracker.behind(self._clock, timeout)
            if behind:
                return _none_for(timeout, behind)
            timeout = LONGEST_STANDSTILL
            is_waiting = not is_moving or now - self._sent[0] <= timeout
        silent = tracker.silent(now, timeout)
        if silent:
            return _none_for(timeout, silent)
        stuck = tracker.stuck(now, timeout)
        if is_waiting or not stuck:
            return ""
        assert tracker.stamp is not None  # nothing is missing
        return (
            f"joint-state stamps do not advance: messages come, but for {timeout:g} s none later "
            f"than {tracker.stamp * 1e-9:.3f} s of: {', '.join(stuck)}"
        )

    def _is_simulated(self) -> bool:
        newest = self._tracker.stamp
        if self._clock is None or newest is None:
            return False
        return -_LOST <= self._clock - newest <= _AHEAD


def _none_for(timeout: float, joints: tuple[str, ...]) -> str:
    return f"no joint state for {timeout:g} s of: {', '.join(joints)}"
