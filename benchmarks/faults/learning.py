"""Faults while a robot of two joints learns: kills of the learner, a torn bag among the trials."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import toy_robot
from fake_robot import FakeRobot
from ros_graph import NodeProcess, RosGraph

from benchmarks.faults.table import Fault, Outcome
from benchmarks.faults.workplace import CONTROLLER, RECORDER, call
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.ros.clients import Clients
from irlpilco_ros.ros.learner_progress import LearnerProgress, MalformedProgressError
from irlpilco_ros.ros.qos import DIAGNOSTICS

from diagnostic_msgs.msg import DiagnosticArray  # isort: skip

STAGES = ("model", "policy", "hand over", "move to start", "trial")
ANSWER = 120.0  # [s]


class Learning:
    """All nodes, with a robot in lockstep, and a run that goes on."""

    def __init__(self, ros: RosGraph, folder: Path) -> None:
        self.ros = ros
        self.run = RunDirectory(folder / "run")
        self.stage = "idle"
        self._clients = Clients(ros.node)
        self._robot_file = folder / "robot.yaml"
        self._robot_file.write_text(toy_robot.ROBOT_FILE, encoding="utf-8")
        self._settings = {
            "evaluations": 6,
            "run_directory": str(self.run.path),
            "demonstration": str(toy_robot.record_demonstration(folder / "shown")),
        }
        ros.node.create_subscription(DiagnosticArray, "learner/progress", self._hear, DIAGNOSTICS)
        ros.start(CONTROLLER, files=[self._robot_file])
        ros.start(RECORDER, files=[self._robot_file])
        self.learner = self.start_learner()
        start = toy_robot.demonstrated().positions[0].tolist()
        self.robot = FakeRobot(ros, toy_robot.JOINTS, start, lockstep=True)

    def start_learner(self) -> NodeProcess:
        """Start it anew, to go on with the run."""
        module = "irlpilco_ros.nodes.learner"
        return self.ros.start(module, files=[self._robot_file], parameters=self._settings)

    def learn(self) -> str:
        """Do an iteration; return what the learner says of it first."""
        answer = call(self.ros, self._clients, "learn_iteration", "learner")
        self.ros.wait_for(answer.done, "an iteration", ANSWER)
        return str(answer.result()).partition(" (")[0]

    def killed_in(self, stage: str) -> Outcome:
        """Kill the learner in a stage of an iteration, start it again, and let it go on."""
        before = self.run.metrics() if self.run.metrics_file.exists() else ()
        answer = call(self.ros, self._clients, "learn_iteration", "learner")
        self.ros.wait_for(lambda: self.stage == stage or answer.done(), stage, ANSWER)
        self.learner.kill()
        killed = self.stage
        self.learner, self.stage = self.start_learner(), "idle"
        again = self.learn()
        rows = self.run.metrics()
        # As texts: NaN is no NaN.
        kept = len(rows) > len(before) and str(rows[: len(before)]) == str(before)
        sound = kept and [row.iteration for row in rows] == list(range(len(rows)))
        return Outcome(f"killed in {killed}; then {again}" if sound else "", lost=0)

    def torn(self) -> Outcome:
        """Cut the last trial's bag in half, and let the learner go on."""
        _, bag = self.run.trial_bags()[-1]
        [file] = bag.glob("*.mcap")
        with file.open("rb+") as storage:
            storage.truncate(file.stat().st_size // 2)
        self.learner.stop()
        self.learner = self.start_learner()
        again = self.learn()
        said = [line for line in self.learner.output.splitlines() if "is lost" in line]
        told = f"{said[-1].rpartition(']: ')[2]}; {again}" if said else ""
        return Outcome(told)

    def _hear(self, message: DiagnosticArray) -> None:
        try:
            progress = LearnerProgress.from_message(message)
        except MalformedProgressError:
            return
        if progress is not None:
            self.stage = progress.stage


@contextmanager
def learning() -> Iterator[Learning]:
    """Start the nodes; end them afterwards, whatever was done to them."""
    with TemporaryDirectory(prefix="irlpilco_faults_") as folder, RosGraph(Path(folder)) as ros:
        place = Learning(ros, Path(folder))
        with place.robot:
            try:
                print(place.learn(), flush=True)
                yield place
            finally:
                for process in ros.processes:
                    process.expected_code = None


def in_learning(tries: int, say: Callable[[Fault], None]) -> None:
    """Kill the learner in each stage, and tear bags of trials."""
    with learning() as place:
        for stage in STAGES:
            outcomes = tuple(place.killed_in(stage) for _ in range(tries))
            say(Fault(f"kill -9 of the learner, stage {stage}", outcomes))
        say(Fault("a bag among the trials is torn", tuple(place.torn() for _ in range(tries))))
