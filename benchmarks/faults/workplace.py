"""A controller and a recorder in processes of their own, a robot that misbehaves, and tries."""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# Robot and graph are those of the tests.
sys.path += [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "nodes")]

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from fake_robot import FakeRobot  # noqa: E402
from ros_graph import RosGraph  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from benchmarks.faults.table import Outcome  # noqa: E402
from irlpilco_ros.experience.bag_reader import read_bag  # noqa: E402
from irlpilco_ros.experience.errors import BagError  # noqa: E402
from irlpilco_ros.experience.policy_file import policy_to_parameters  # noqa: E402
from irlpilco_ros.learning.joints import Joints  # noqa: E402
from irlpilco_ros.learning.policies import OpenLoopPolicy  # noqa: E402
from irlpilco_ros.ros.clients import Clients, ServiceError  # noqa: E402
from irlpilco_ros.ros.qos import DIAGNOSTICS  # noqa: E402

CONTROLLER = "irlpilco_ros.nodes.controller"
RECORDER = "irlpilco_ros.nodes.demonstration_recorder"
JOINTS = ("elbow", "wrist")
HORIZON = 100
PERIOD = 0.1
ROBOT: dict[str, Any] = {
    "joints": list(JOINTS),
    "position_lower": [-2.0, -2.0],
    "position_upper": [2.0, 2.0],
    "velocity_limit": [1.0, 1.0],
    "control_period": PERIOD,
    "horizon": HORIZON,
}
UNDISTURBED = 0.5
"""How long a trial goes on before the fault [s]."""

ANSWER = 40.0
"""How long an answer is waited for; DDS takes 20 s to miss a process that was killed [s]."""

WAIT = 3.0
"""How long zero velocity is waited for [s]."""


def policy(speed: float = 0.1) -> dict[str, Any]:
    """Return a policy, as parameters, that moves both joints at this speed [rad/s]."""
    table = np.full((HORIZON, len(JOINTS)), speed)
    return policy_to_parameters(OpenLoopPolicy(table, np.ones(len(JOINTS)), 4), Joints(JOINTS))


class Workplace:
    """The nodes, and the robot at 100 Hz in real time."""

    def __init__(self, ros: RosGraph, folder: Path) -> None:
        self.ros = ros
        self._clients = Clients(ros.node)
        self._promised: dict[str, int] = {}
        self.bag = Path()
        self.last_stop = ""
        ros.node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, DIAGNOSTICS)
        recordings = {"output_directory": str(folder / "recordings")}
        self.controller = ros.start(CONTROLLER, parameters=ROBOT, wait=False)
        self.recorder = ros.start(RECORDER, parameters={**ROBOT, **recordings})
        ros.wait_for_node("controller", self.controller)
        self.robot = FakeRobot(ros, JOINTS, wall_step=0.01)

    def run(self, fault: Callable[[Workplace], Any], ends_trial: bool = True) -> Outcome:
        """Disturb a recorded trial; return how long the robot went on, what is lost, what is told.

        Args:
            fault: Makes the fault; may return when it began [s, steady clock], if that is not when
                it was called.
            ends_trial: Whether the trial has to be broken off for it.
        """
        answer = self._begin()
        began = time.monotonic()
        later = fault(self)
        began = later if isinstance(later, float) else began
        stopped = self._wait_for_zero(began) if ends_trial else None
        if not ends_trial:
            time.sleep(2.0)
        told = self._told(answer, ends_trial)
        if self.recorder.is_alive:
            self.last_stop = self.ros.trigger("demonstration_recorder/stop").message
        return Outcome(told, stopped, self.lost(self.bag))

    def lost(self, bag: Path) -> int:
        """Return how many samples the recorder has told of that cannot be read."""
        promised = self._promised.get(str(bag), 0)
        try:
            return max(0, promised - len(read_bag(bag).stamps))
        except BagError:
            return promised

    def _begin(self) -> Any:
        """Start a recorded trial that goes on for a while; on a busy computer, try again."""
        # Clients that are known already: what is measured is the controller.
        self.ros.trigger("controller/stop")
        self.ros.call(SetBool, "controller/enable", SetBool.Request(data=True))
        robot, deadline = self.robot, time.monotonic() + 60.0
        while time.monotonic() < deadline:
            robot.positions.update(dict.fromkeys(JOINTS, 0.0))
            assert self.ros.set_parameters("controller", policy()).successful
            recording = self.ros.trigger("demonstration_recorder/start")
            robot.commands.clear()
            robot.heard.clear()
            answer = call(self.ros, self._clients, "controller/run_trial")
            end = time.monotonic() + 10.0
            while not answer.done() and len(robot.heard) < 3 and time.monotonic() < end:
                time.sleep(0.01)
            time.sleep(UNDISTURBED)
            if recording.success and not answer.done():
                self.bag = Path(recording.message.rpartition("bag: ")[2])
                return answer
            self.ros.trigger("controller/stop")
            self.ros.trigger("demonstration_recorder/stop")
        raise RuntimeError(f"no trial went on undisturbed: {recording.message}")

    def _wait_for_zero(self, began: float) -> float:
        deadline = time.monotonic() + WAIT
        while time.monotonic() < deadline:
            commands = list(zip(list(self.robot.heard), list(self.robot.commands), strict=False))
            for heard, command in commands:
                if heard > began and not any(command.velocity):
                    return heard - began
            time.sleep(0.005)
        return math.inf

    def _told(self, answer: Any, ends_trial: bool) -> str:
        deadline = time.monotonic() + (ANSWER if ends_trial else 0.0)
        while not answer.done() and time.monotonic() < deadline:
            time.sleep(0.01)
        if answer.done():
            return str(answer.result())
        if ends_trial:
            return ""
        warnings = re.findall(r"^\[WARN\].*?\]: (.*)$", self.controller.output, re.MULTILINE)
        return "; ".join(["the trial goes on", *warnings[-1:]])

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {item.key: item.value for item in status.values}
            if status.name == "demonstration_recorder" and "samples" in values:
                path = status.message.removeprefix("recording ")
                self._promised[path] = int(values["samples"])


def call(ros: RosGraph, clients: Clients, service: str, node: str = "") -> Any:
    """Call a std_srvs/Trigger as the command line does; return the task of what it says.

    Args:
        ros: Where.
        clients: Of the graph's own node.
        service: Its name.
        node: Whose it is, if that has just been started.
    """

    async def answer() -> str:
        try:
            if node:
                await clients.meet({node: [service]}, 60.0)
            return await clients.trigger(service, 120.0)
        except ServiceError as error:
            return str(error)

    return ros._executor.create_task(answer())


@contextmanager
def workplace() -> Iterator[Workplace]:
    """Start the nodes; end them afterwards, whatever was done to them."""
    with TemporaryDirectory(prefix="irlpilco_faults_") as folder, RosGraph(Path(folder)) as ros:
        place = Workplace(ros, Path(folder))
        with place.robot:
            try:
                yield place
            finally:
                for process in ros.processes:
                    process.expected_code = None
