"""Nodes as processes of their own: start them, notice when one dies, stop them all."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from irlpilco_ros.experience.private_folder import make_private
from irlpilco_ros.learning.errors import IrlPilcoError

STOP_TIMEOUT = 10.0
"""How long a node may take to stop after SIGINT before it is killed [s]."""

LOG_LINES = 15
"""Lines of a dead node's log that are shown."""


class NodeDiedError(IrlPilcoError):
    """A node that should be running has ended."""


@dataclass(frozen=True)
class NodeProcess:
    """One running node.

    Attributes:
        name: Name of the node.
        process: Its process, leader of a session and process group of its own.
        log: Where its stdout and stderr go.
    """

    name: str
    process: subprocess.Popen[bytes]
    log: Path

    def last_lines(self) -> str:
        """Return the last lines of its log, indented."""
        lines = self.log.read_text(errors="replace").splitlines()[-LOG_LINES:]
        return "\n".join(f"    {line}" for line in lines) or "    (nothing was logged)"


class NodeProcesses:
    """A group of nodes that live and end together; use it in a `with` statement."""

    def __init__(self, log_directory: Path, environment: Mapping[str, str]) -> None:
        """Start nothing yet.

        Args:
            log_directory: Folder for one log file per node, made if missing.
            environment: The nodes' whole environment variables.
        """
        self._log_directory = log_directory
        self._environment = dict(environment)
        self._nodes: list[NodeProcess] = []

    def start(self, name: str, module: str, arguments: Sequence[str] = ()) -> NodeProcess:
        """Start `python -m module arguments` as the node `name`; its log is name.log."""
        make_private(self._log_directory)
        log = self._log_directory / f"{name}.log"
        with log.open("ab") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "irlpilco_ros.entry", module, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
            )
        node = NodeProcess(name, process, log)
        self._nodes.append(node)
        return node

    def check(self) -> None:
        """Make sure that every node is still running.

        Raises:
            NodeDiedError: names the node and its exit code and shows the end of its log.
        """
        for node in self._nodes:
            code = node.process.poll()
            if code is not None:
                raise NodeDiedError(
                    f"the node {node.name} ended with {_exit_text(code)}. "
                    f"The end of its log {node.log}:\n{node.last_lines()}"
                )

    def stop(self) -> list[str]:
        """Stop all nodes, each by its own process group.

        Returns:
            A complaint for each node that had to be killed or did not end with exit code 0.
        """
        for node in self._nodes:
            _signal_group(node, signal.SIGINT)
        deadline = time.monotonic() + STOP_TIMEOUT
        complaints = []
        for node in self._nodes:
            try:
                code = node.process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                _signal_group(node, signal.SIGKILL)
                node.process.wait()
                complaints.append(f"{node.name} did not stop within {STOP_TIMEOUT:.0f} s: killed")
            else:
                if code not in (0, -signal.SIGINT):  # the latter while it was still importing
                    complaints.append(f"{node.name} ended with {_exit_text(code)}; see {node.log}")
        self._nodes.clear()
        return complaints

    def __enter__(self) -> NodeProcesses:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop all nodes, and say which did not stop as they should."""
        for complaint in self.stop():
            print(f"irlpilco: {complaint}", file=sys.stderr)


def _signal_group(node: NodeProcess, number: signal.Signals) -> None:
    """Signal the node and whatever it started; one that has ended is left alone."""
    if node.process.poll() is None:
        os.killpg(node.process.pid, number)


def _exit_text(code: int) -> str:
    """Return "exit code 1" or "signal SIGKILL"."""
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
