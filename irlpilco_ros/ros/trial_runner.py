"""What one recorded trial takes on the wire: hand over, move to the start, record, run, stop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from irlpilco_ros.ros.clients import Clients, RefusedError, ServiceError

ANSWER_TIMEOUT = 10.0
"""How long a recorder may take to start or stop [s]."""

MOTION_TIMEOUT = 300.0
"""How long the robot may take for a motion [s]; the controller itself breaks off far sooner."""

RECORDER = "demonstration_recorder"
"""Name of the node that records."""

BAG_PREFIX = "bag: "
"""What stands before the bag's path at the end of the recorder's answer to `stop`."""


class TrialRunner:
    """Runs trials on the robot through the controller and the recorder."""

    def __init__(self, clients: Clients, reset_service: str = "") -> None:
        """Call services with these clients.

        Args:
            clients: Who calls.
            reset_service: What brings the robot to its start; empty for controller/move_to_start.
        """
        self._clients = clients
        self._to_start = reset_service or "controller/move_to_start"

    async def settle(self) -> None:
        """End what a learner that was killed may have left running: a motion, a recording.

        Raises:
            ServiceError: controller or recorder are not there.
        """
        await self.halt()
        with suppress(RefusedError):  # nothing is being recorded: as it should be
            await self._clients.trigger(f"{RECORDER}/stop", ANSWER_TIMEOUT)

    async def halt(self) -> None:
        """End whatever motion is under way.

        Raises:
            ServiceError: the controller is not there.
        """
        await self._clients.trigger("controller/stop", ANSWER_TIMEOUT)

    async def hand_over(self, parameters: Mapping[str, Any]) -> None:
        """Give the controller its policy and start; all of it or nothing.

        Raises:
            ServiceError: it is not there, or refuses; says why.
        """
        await self._clients.set_parameters("controller", parameters)

    async def run(
        self, parameters: Mapping[str, Any], directory: Path, say: Callable[[str], None]
    ) -> Path:
        """Run one trial and record it.

        Args:
            parameters: The controller's parameters: policy and start position.
            directory: Folder that gets the bag.
            say: Called with the name of each stage.

        Returns:
            Path of the trial's bag.

        Raises:
            ServiceError: says which step failed and why. Whatever was recorded is kept.
        """
        say("hand over")
        await self.hand_over(parameters)
        say("move to start")
        await self._clients.trigger(self._to_start, MOTION_TIMEOUT)
        say("trial")
        bag, _ = await self.record("controller/run_trial", directory)
        return bag

    async def record(self, motion: str, directory: Path) -> tuple[Path, str]:
        """Record what the robot does while the service `motion` runs.

        Returns:
            Path of the bag, and what the recorder says about it.

        Raises:
            ServiceError: says which step failed and why. Whatever was recorded is kept.
        """
        await self._start(directory)
        try:
            await self._clients.trigger(motion, MOTION_TIMEOUT)
        except ServiceError as failure:
            answer = await self._stop_after(failure)
            raise ServiceError(f"{failure}; recorded up to there: {answer}") from failure
        answer = await self._clients.trigger(f"{RECORDER}/stop", ANSWER_TIMEOUT)
        return _bag_in(answer), answer

    async def _start(self, directory: Path) -> None:
        """Start to record into a folder, this once; nothing has to be set back after it."""
        await self._clients.set_parameters(RECORDER, {"next_directory": str(directory)})
        await self._clients.trigger(f"{RECORDER}/start", ANSWER_TIMEOUT)

    async def _stop_after(self, failure: ServiceError) -> str:
        """End the recording of a motion that failed; return what the recorder says."""
        try:
            return await self._clients.trigger(f"{RECORDER}/stop", ANSWER_TIMEOUT)
        except RefusedError as refused:
            return str(refused)
        except ServiceError as another:
            raise ServiceError(f"{failure}; and {another}") from failure


def _bag_in(answer: str) -> Path:
    """Return the path at the end of the recorder's answer."""
    _, found, path = answer.rpartition(BAG_PREFIX)
    if not found:
        raise ServiceError(f"the recorder's answer names no bag: {answer!r}")
    return Path(path.strip())
