"""`irlpilco demo` as a process: its rows, what it does when a node dies, how it is stopped."""

from __future__ import annotations

import csv
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

from irlpilco_ros.experience.metrics import DEMONSTRATION, REPLAY
from irlpilco_ros.experience.places import read_places
from irlpilco_ros.experience.run_directory import RunDirectory
from sim_bridge.rendering import can_render

pytestmark = [pytest.mark.dds, pytest.mark.slow]

# The report is tested elsewhere, and takes longer than all the rest.
PROGRAM = """
import sys
from irlpilco_ros.commands import demo
demo.make_report = lambda path: path / "report" / "index.html"
from irlpilco_ros.cli import main
sys.exit(main(["demo", *sys.argv[1:]]))
"""
SETTINGS = "/**:\n  ros__parameters:\n    evaluations: 4\n"
NODES = {
    "baxter_simulator",
    "demonstrator",
    "demonstration_recorder",
    "controller",
    "learner",
}


class RunningDemo:
    """The demo in a process of its own, and what can be seen of it from outside."""

    def __init__(self, folder, repository, *words):
        self.run = RunDirectory(folder / "run")
        settings = folder / "settings.yaml"
        settings.write_text(SETTINGS)
        environment = {**os.environ, "PYTHONPATH": str(repository)}
        environment.pop("ROS_DOMAIN_ID", None)
        self.output = folder / "output.txt"
        command = [sys.executable, "-c", PROGRAM, "--run-directory", str(self.run.path)]
        with self.output.open("wb") as output:
            self.process = subprocess.Popen(
                [*command, "--settings", str(settings), *words],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def children(self):
        """Return the process id of each running node by its name."""
        pid = self.process.pid
        found = {}
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
            if b"irlpilco_ros.entry" in words:
                module = words[words.index(b"irlpilco_ros.entry") + 1].decode()
                found[module.rpartition(".")[2].removesuffix("_node")] = int(child)
        return found

    def wait_for_text(self, text):
        deadline = time.monotonic() + 180.0
        while text not in self.text():
            assert time.monotonic() < deadline, self.text()
            assert self.process.poll() is None, self.text()
            time.sleep(0.05)

    def text(self):
        return self.output.read_text()


@pytest.fixture
def demo(tmp_path, repository):
    running = []

    def begin(*words):
        running.append(RunningDemo(tmp_path, repository, *words))
        return running[-1]

    yield begin
    for each in running:
        if each.process.poll() is None:
            os.killpg(each.process.pid, signal.SIGTERM)
            each.process.wait(60.0)


def is_gone(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def test_it_demonstrates_replays_learns_goes_elsewhere_and_stops_its_nodes(demo, tmp_path):
    places = tmp_path / "places.yaml"
    places.write_text("- [0.05, -0.03, 0.2, 1.25]\n- [0.6, 0.0, 0.0]\n")
    shown = demo("--iterations", "1", "--seed", "4", "--moved", str(places))
    shown.wait_for_text("learning: ")
    nodes = shown.children()
    assert set(nodes) == NODES
    assert shown.process.wait(300.0) == 0, shown.text()
    assert all(is_gone(pid) for pid in nodes.values())
    lines = shown.text().splitlines()
    assert lines[0].startswith(f"run directory {shown.run.path}, ROS_DOMAIN_ID ")
    end = next(k for k, line in enumerate(lines) if line.startswith("best: "))
    table = [
        line.split()
        for line in lines[:end]
        if line[:1] == " " or line.startswith("demonstration  ")
    ]
    assert [row[0] for row in table] == ["demonstration", "replay", "0", "1"]
    replay, first = shown.run.baseline_metrics(REPLAY), shown.run.metrics()[1]
    assert table[1][2:5:2] == [f"{replay.path_rmse_rad:.4f}", f"{replay.rmse_rad:.4f}"]
    assert table[3][2:5:2] == [f"{first.path_rmse_rad:.4f}", f"{first.rmse_rad:.4f}"]
    shown_row = shown.run.baseline_metrics(DEMONSTRATION)
    assert 0.1 < shown_row.acceleration_p99 < first.acceleration_max
    assert first.rmse_rad < first.path_rmse_rad < first.path_max_rad < 0.1
    assert first.rmse_rad < 0.05
    best = min(shown.run.metrics()[:2], key=lambda row: row.mse)
    assert lines[end].startswith(f"best: iteration {best.iteration}, trial {best.trial:03d}, ")
    assert lines[-1] == f"report: {shown.run.report_directory / 'index.html'}"
    assert shown.run.configuration()["seed"] == 4
    assert shown.run.configuration()["evaluations"] == 4
    assert {path.stem for path in (shown.run.path / "log").glob("*.log")} == NODES
    # Then the pile lies elsewhere, and once where no arm can sweep.
    with (shown.run.path / "moved.csv").open() as file:
        there, refused = csv.DictReader(file)
    assert [there["place"], there["turn"], there["trials_there"]] == ["1", "0.2", "0"]
    assert [there["speed"], refused["speed"]] == ["1.25", "1.0"]
    # The way of 32 decisions takes 26 of them, and the robot's time counts what was done.
    seconds = [row.robot_time_s for row in shown.run.metrics()]
    assert seconds[2] - seconds[1] == pytest.approx(26 / 32 * seconds[0])
    elsewhere = shown.run.metrics()[2]
    assert float(there["path_rmse_rad"]) == elsewhere.path_rmse_rad < 0.05
    assert 0.0 < float(there["tool_rmse_m"]) < 0.05
    assert 0.0 < float(there["predicted_rmse_rad"]) < 0.03
    assert 0 <= int(there["pieces"]) <= int(there["of_pieces"]) == 20
    assert math.isnan(float(refused["path_rmse_rad"]))
    assert any("refused: " in line and "out of reach" in line for line in lines[end:])
    if can_render():
        assert f"pictures: {shown.run.path / 'moved.webp'}" in lines
        assert Image.open(shown.run.path / "moved.webp").size[0] > 900  # two, side by side
    assert len(shown.run.metrics()) == 3
    assert len(read_places(shown.run.places_directory)) == 1


def test_a_node_that_dies_ends_it_with_the_reason(demo):
    shown = demo()
    shown.wait_for_text("demo: demonstration")
    nodes = shown.children()
    os.kill(nodes["controller"], signal.SIGKILL)
    assert shown.process.wait(60.0) == 1
    assert "irlpilco: the node controller ended with signal SIGKILL" in shown.text()
    assert "Traceback" not in shown.text()
    assert all(is_gone(pid) for pid in nodes.values())


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_it_stops_its_nodes_when_it_is_told_to_end(demo, number, code):
    shown = demo()
    shown.wait_for_text("demo: start the nodes")
    nodes = shown.children()
    os.kill(shown.process.pid, number)
    assert shown.process.wait(60.0) == code
    assert all(is_gone(pid) for pid in nodes.values())
    assert "Traceback" not in shown.text()
