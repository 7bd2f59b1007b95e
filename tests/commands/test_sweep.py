"""`irlpilco sweep` as a process, with nodes as processes: what sweep.launch.py starts."""

from __future__ import annotations

import signal
import sys
from typing import Any

import pytest
import yaml

from irlpilco_ros.experience.run_directory import RunDirectory

pytestmark = [pytest.mark.dds, pytest.mark.slow]

# The report is tested elsewhere, and takes longer than all the rest.
PROGRAM = """
import sys
from irlpilco_ros.commands import sweep
sweep.START_TIMEOUT = {timeout}
sweep.make_report = lambda path: path / "report" / "index.html"
from irlpilco_ros.cli import main
sys.exit(main(["sweep", *sys.argv[1:]]))
"""
LEARNING = {"evaluations": 4, "linear_phase.count": 8}
NODES: dict[str, dict[str, Any]] = {
    "sim_bridge.baxter_simulator_node": {"lockstep": True},
    "sim_bridge.demonstrator_node": {},
    "irlpilco_ros.nodes.demonstration_recorder": {},
    "irlpilco_ros.nodes.controller": {},
    "irlpilco_ros.nodes.learner": LEARNING,
}


class Robot:
    """The nodes under /robot, with half of the sweep's horizon, and the command beside them."""

    def __init__(self, graph, folder, repository):
        self.graph = graph
        self.run = RunDirectory(folder / "run")
        self.file = folder / "robot.yaml"
        shipped = (repository / "config/baxter.yaml").read_text()
        self.file.write_text(shipped.replace("horizon: 16", "horizon: 8"))

    def start(self, module, **parameters):
        """Start one node; the command waits for it, not the test."""
        parameters = {**NODES[module], **parameters}
        if module.endswith("learner"):
            parameters["run_directory"] = str(self.run.path)
        return self.graph.start(
            module, parameters=parameters, files=[self.file], namespace="/robot", wait=False
        )

    def sweep(self, *words, timeout=180.0):
        """Start the command."""
        program = PROGRAM.format(timeout=timeout)
        words = ("--iterations", "1", "--namespace", "/robot", *words)
        log = f"sweep_{len(self.graph.processes)}.log"
        return self.graph.run([sys.executable, "-c", program, *words], log=log)


@pytest.fixture
def robot(ros, tmp_path, repository):
    return Robot(ros, tmp_path, repository)


def fails(process, *said, timeout=180.0):
    """The command ends with exit code 1 and one sentence that says all this."""
    process.expected_code = 1
    process.wait(timeout)
    last = process.output.splitlines()[-1]
    assert last.startswith("irlpilco: "), process.output
    assert all(words in last for words in said), last
    assert "Traceback" not in process.output
    return True


def test_it_waits_for_the_nodes_does_it_all_and_goes_on_when_called_again(robot):
    first = robot.sweep()
    for module in reversed(NODES):
        robot.start(module)
    assert first.wait(300.0) == 0
    assert "demonstration: " in first.output
    assert "\niteration 1: " in first.output
    assert first.output.splitlines()[-1].startswith("report: ")
    (bag,) = (robot.run.path / "recordings").iterdir()
    recorded = {path: path.read_bytes() for path in robot.run.path.rglob("*.mcap")}

    second = robot.sweep()
    assert second.wait(300.0) == 0
    assert "demonstration: " not in second.output
    assert [row.iteration for row in robot.run.metrics()] == [0, 1, 2]
    assert list(bag.parent.iterdir()) == [bag]
    assert {path: path.read_bytes() for path in recorded} == recorded


@pytest.mark.parametrize(
    "missing", ["irlpilco_ros.nodes.controller", "sim_bridge.demonstrator_node"]
)
def test_a_node_that_is_not_there_is_named(robot, missing):
    for module in NODES:
        if module != missing:
            robot.start(module)
    for module in NODES:
        if module != missing:
            robot.graph.wait_for_node(f"robot/{module.rsplit('.', 1)[-1].removesuffix('_node')}")
    name = missing.rsplit(".", 1)[-1].removesuffix("_node")
    assert fails(robot.sweep(timeout=3.0), f"service {name}/", "is not there")
    assert not robot.run.path.exists()


def test_a_step_that_is_refused_ends_it_with_the_reason(robot):
    """Here the recorder, which has no joints to record, at `start`."""
    robot.file.write_text(
        yaml.safe_dump(yaml.safe_load(robot.file.read_text()))
        + "/**/demonstration_recorder:\n  ros__parameters:\n    joints: [nobody]\n"
    )
    for module in NODES:
        robot.start(module)
    assert fails(robot.sweep(), "demonstration_recorder/start refused", "nobody")
    assert not robot.run.demonstration_directory.exists()


def test_an_iteration_that_fails_ends_it_with_the_reason(robot):
    """Here the controller, which is killed in the trial; what was recorded stays."""
    for module in NODES:
        process = robot.start(module)
        if module.endswith("controller"):
            controller = process
    sweep = robot.sweep()
    robot.graph.wait_for(lambda: "iteration 0, trial" in sweep.output, "a trial", 180.0)
    controller.send(signal.SIGKILL)
    controller.expected_code = None
    assert fails(sweep, "learn_iteration refused", "controller/run_trial")
    assert robot.run.demonstration_directory.is_dir()
    assert (robot.run.trials_directory / "000").is_dir()
