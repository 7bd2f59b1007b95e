"""Computing beside the executor: one thread, one job at a time, its result an rclpy Future."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from rclpy.executors import Executor
from rclpy.task import Future

from irlpilco_ros.learning.errors import IrlPilcoError

Result = TypeVar("Result")


class CancelledError(IrlPilcoError):
    """The node stops or an iteration is cancelled, and so is what was being computed."""


class LearnerWorker:
    """Runs a job in a thread, so that the executor goes on answering.

    numpy and scipy let go of the interpreter lock in their long calls; the node's callbacks run
    in between.
    """

    def __init__(self, executor: Callable[[], Executor | None]) -> None:
        """Start nothing yet.

        Args:
            executor: Returns the executor that wakes whoever awaits a result.
        """
        self._executor = executor
        self._cancelled = threading.Event()
        self._thread: threading.Thread | None = None

    def run(self, job: Callable[[], Result]) -> Future:
        """Start the job and return the future of its result or its exception."""
        future = Future(executor=self._executor())

        def work() -> None:
            try:
                self.check()
                result = job()
            except Exception as error:
                future.set_exception(error)
            else:
                future.set_result(result)

        self._thread = threading.Thread(target=work, name="learner_worker", daemon=True)
        self._thread.start()
        return future

    def check(self) -> None:
        """Break off the job if the node stops; the job calls this often.

        Raises:
            CancelledError: `cancel` was called.
        """
        if self._cancelled.is_set():
            raise CancelledError("the learner was told to stop; the iteration was broken off")

    def cancel(self, timeout: float) -> bool:
        """Break off the job under way and every later one; wait for its end.

        Returns:
            Whether the thread ended within `timeout` [s].
        """
        self._cancelled.set()
        if self._thread is None:
            return True
        self._thread.join(timeout)
        return not self._thread.is_alive()
