"""Where a running robot is now, where it was shown to be, and what the learner is doing."""

from __future__ import annotations

import time
from collections.abc import Callable

from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import decode
from irlpilco_ros.ros.qos import JOINT_STATES_PUB, JOINT_STATES_SUB
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.session import Session

_SILENT = 1.0  # [s] after which a robot's last word is old
_LISTEN = 0.02  # [s]


class LiveRobot:
    """Listens to joint_states and controller/reference, and to the learner by its session."""

    def __init__(self, session: Session) -> None:
        """Begin to listen."""
        self._session = session
        self._positions: dict[str, float] = {}
        self._heard = 0.0
        self._states = SafeSubscription(
            session.node, JointState, "joint_states", self._take, JOINT_STATES_SUB
        )
        self._shown: dict[str, float] = {}
        self._references = SafeSubscription(
            session.node, JointState, "controller/reference", self._take_shown, JOINT_STATES_PUB
        )

    def tell(self, show: Callable[[dict[str, float], dict[str, float], str], None]) -> bool:
        """Listen for a moment, and show what came.

        Args:
            show: Called with the positions by joint [rad], with those that were shown for this
                moment of the trial, empty before the first, and with a line on what is going on.

        Returns:
            True: there is more to come.
        """
        progress = self._session.progress
        self._session.run(self._session.clients.sleep(_LISTEN))
        # `run` forgets what was said before it; the last word counts until there is another.
        progress = self._session.progress = self._session.progress or progress
        if time.monotonic() - self._heard > _SILENT:
            words = f"**no joint state** on {self._states.topic_name}"
        elif progress is not None and progress.iteration >= 0:
            done = f"{progress.stage}, {100.0 * progress.fraction:.0f} %"
            words = f"**live**: iteration {progress.iteration}, {done} {progress.details()}"
        else:
            words = f"**live**: {self._states.topic_name}"
        show(dict(self._positions), dict(self._shown), words)
        return True

    def _take(self, data: bytes, _: Info) -> None:
        message = decode(data)
        self._positions.update(zip(message.names, message.positions, strict=False))
        self._heard = time.monotonic()

    def _take_shown(self, data: bytes, _: Info) -> None:
        message = decode(data)
        self._shown = dict(zip(message.names, message.positions, strict=False))
