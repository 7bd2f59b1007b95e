"""The whole sweep over DDS: five processes, a demonstration, iterations, and kills on the way.

One graph serves all tests, in the order in which they stand: each goes on with the run of the one
before, as a user would.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.metrics import DEMONSTRATION
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.ros.learner_progress import LearnerProgress
from irlpilco_ros.ros.qos import COMMAND_RECORDING, DIAGNOSTICS

pytestmark = [pytest.mark.dds, pytest.mark.slow]

SHIPPED = Path(__file__).resolve().parents[1] / "config" / "baxter.yaml"
HORIZON = 8  # the first half of the sweep: a quarter of the computing
WINDOW = [0.0, 0.5 * HORIZON]  # [s]
LEFT_ARM = tuple(f"left_{joint}" for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2"))
COMMANDS = 70  # those of 0.7 s, in which there are two decisions
SETTINGS = "/**:\n  ros__parameters:\n    evaluations: 10\n    linear_phase.count: 8\n"


class Pipeline:
    """The nodes, and the run that they work on."""

    def __init__(self, graph, folder):
        self.graph = graph
        self.run = RunDirectory(folder / "run")
        self.settings = folder / "settings.yaml"
        self.settings.write_text(SETTINGS)
        self.progress = graph.listen(DiagnosticArray, "learner/progress", DIAGNOSTICS)
        self.health = graph.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        self.commands = graph.listen(JointState, "joint_command", COMMAND_RECORDING)
        self.robot = folder / "robot.yaml"
        self.robot.write_text(SHIPPED.read_text())
        recordings = {"output_directory": str(folder / "recordings")}
        self.simulator = self.start_simulator()
        graph.start("sim_bridge.demonstrator_node", files=[self.robot], wait=False)
        graph.start(
            "irlpilco_ros.nodes.demonstration_recorder",
            parameters=recordings,
            files=[self.robot],
            wait=False,
        )
        graph.start("irlpilco_ros.nodes.controller", files=[self.robot], wait=False)
        for name in ("baxter_simulator", "demonstrator", "demonstration_recorder", "controller"):
            graph.wait_for_node(name)
        self.demonstration = self._demonstrate()
        self.learner = self.start_learner("ready for iteration 0", str(self.demonstration))

    def start_simulator(self):
        return self.graph.start(
            "sim_bridge.baxter_simulator_node",
            parameters={"lockstep": True, "seed": 1},
            files=[self.robot],
            wait=False,
        )

    def start_learner(self, first_words, demonstration=""):
        """Start a learner and wait until it says on /diagnostics how far the run has come."""
        self.health.clear()
        learner = self.graph.start(
            "irlpilco_ros.nodes.learner",
            parameters={
                "run_directory": str(self.run.path),
                "demonstration": demonstration,
                "demonstration_window": WINDOW,
            },
            files=[self.robot, self.settings],
            wait=False,
        )
        self.graph.wait_for(lambda: first_words in self.words_of_learner(), first_words)
        return learner

    def words_of_learner(self):
        statuses = (status for message in self.health.messages for status in message.status)
        return {status.message for status in statuses if status.name == "learner"}

    def _demonstrate(self):
        for step in ("demonstrator/move_to_start", "demonstration_recorder/start"):
            self.check(self.graph.trigger(step, 60.0))
        self.check(self.graph.trigger("demonstrator/play", 60.0))
        answer = self.check(self.graph.trigger("demonstration_recorder/stop"))
        assert answer.startswith("17 samples, 0 missing")
        return answer.partition("bag: ")[2]

    def learn(self):
        return self.check(self.graph.trigger("learn_iteration", 120.0))

    def check(self, answer):
        assert answer.success, answer.message
        return answer.message

    def stages(self):
        told = (LearnerProgress.from_message(message) for message in self.progress.messages)
        return [progress.stage for progress in told]

    def begin_and_wait_for(self, stage):
        """Call learn_iteration and return its future once the learner is in this stage."""
        self.progress.clear()
        call = self.graph.trigger_async("learn_iteration")
        self.graph.wait_for(lambda: stage in self.stages(), f"stage {stage}")
        return call

    def _moves(self):
        """Whether the arm has been moved for a while: a trial is over in half a second here."""
        return sum(any(message.velocity) for message in self.commands.messages) > COMMANDS

    def begin_and_wait_for_commands(self):
        """Call learn_iteration; return its future and the trial's bag, once a trial runs."""
        number = self.run.trial_bags()[-1][0] + 1
        bag = self.run.trials_directory / f"{number:03d}"
        self.progress.clear()
        call = self.graph.trigger_async("learn_iteration")
        self.graph.wait_for(lambda: "trial" in self.stages(), "the trial")
        self.commands.clear()
        self.graph.wait_for(self._moves, "commands")
        return call, bag


@pytest.fixture(scope="module")
def pipeline(shared_ros, tmp_path_factory):
    return Pipeline(shared_ros, tmp_path_factory.mktemp("pipeline"))


def cancelled(pipeline, call):
    """Cancel the iteration under way; return both answers."""
    answer = pipeline.graph.trigger("learner/cancel", 60.0)
    pipeline.graph.wait_for(call.done, "the end of the iteration")
    return answer, call.result()


def test_two_iterations_while_the_learner_stays_responsive(pipeline):
    assert pipeline.learn().startswith("iteration 1: trial 001 ")
    call = pipeline.begin_and_wait_for("policy")
    busy = pipeline.graph.trigger("learn_iteration")
    assert pipeline.graph.get_parameter("learner", "evaluations") == 10
    assert not call.done()
    assert not busy.success
    assert busy.message.startswith("busy: iteration 2 is under way")
    pipeline.graph.wait_for(call.done, "the second iteration", 180.0)
    assert call.result().message.startswith("iteration 2: trial 002 ")

    computing = [
        arrival
        for arrival, stage in zip(pipeline.progress.arrivals, pipeline.stages(), strict=False)
        if stage in ("model", "policy")
    ]
    assert len(computing) - 1 >= computing[-1] - computing[0]

    rows = pipeline.run.metrics()
    assert [(row.iteration, row.trial) for row in rows] == [(0, 0), (1, 1), (2, 2)]
    assert [row.robot_time_s for row in rows] == [4.0, 8.0, 12.0]
    assert rows[2].rmse_rad < 0.03
    assert np.all(np.diff([row.margin for row in rows]) <= 1e-12)  # equal, to rounding, if no gain
    assert rows[2].rmse_rad < rows[0].rmse_rad
    shown = pipeline.run.baseline_metrics(DEMONSTRATION)
    assert shown.path_rmse_rad == 0.0
    for row in rows:
        assert 0.9 * row.rmse_rad < row.path_rmse_rad < row.path_max_rad < 0.3
        assert 0.1 < row.acceleration_p99 < row.acceleration_max
        assert row.acceleration_max > shown.acceleration_p99


def test_training_on_the_bags_finds_the_same_policies(pipeline, tmp_path):
    words = ["-m", "irlpilco_ros.cli", "train", "--run-directory", str(tmp_path / "out")]
    words += ["--demonstration", str(pipeline.demonstration)]
    words += ["--trials", str(pipeline.run.trials_directory), "--settings", str(pipeline.settings)]
    words += ["--robot", str(pipeline.robot), "--demonstration-window", *map(str, WINDOW)]
    training = pipeline.graph.run([sys.executable, *words], log="train.log")
    assert training.wait(120.0) == 0, training.output
    for iteration in range(3):
        name = f"policy_{iteration:03d}.yaml"
        assert (tmp_path / "out" / name).read_bytes() == (pipeline.run.path / name).read_bytes()
    trained = RunDirectory(tmp_path / "out").metrics()
    for name in ("mse", "path_rmse_rad", "acceleration_max"):
        assert [getattr(row, name) for row in trained] == [
            getattr(row, name) for row in pipeline.run.metrics()
        ]


def test_an_iteration_is_cancelled_while_it_computes(pipeline):
    call = pipeline.begin_and_wait_for("policy")
    answer, iteration = cancelled(pipeline, call)
    assert answer.success, answer.message
    assert answer.message == "iteration 3 was cancelled (policy); the run is as it was"
    assert iteration.message == "cancelled: broken off by learner/cancel"
    assert not iteration.success
    assert pipeline.run.iterations() == (1, 2)
    assert pipeline.graph.trigger("learner/cancel").message == "nothing is under way"


def test_a_learner_told_to_stop_while_computing_stops_at_once(pipeline):
    pipeline.begin_and_wait_for("model")
    assert pipeline.learner.stop(signal.SIGTERM) == 0
    assert "still computing" not in pipeline.learner.output
    assert len(pipeline.run.metrics()) == 3
    assert pipeline.run.iterations() == (1, 2)


def test_a_learner_killed_while_computing_goes_on_where_it_was(pipeline):
    pipeline.learner = pipeline.start_learner("ready for iteration 3")
    pipeline.begin_and_wait_for("policy")
    pipeline.learner.kill()
    pipeline.learner = pipeline.start_learner("ready for iteration 3")
    assert pipeline.learn().startswith("iteration 3: trial 003 ")


def test_a_simulator_killed_in_mid_trial_costs_that_trial_only(pipeline):
    call, torn = pipeline.begin_and_wait_for_commands()
    pipeline.simulator.kill()
    pipeline.graph.wait_for(call.done, "the learner's answer")
    assert not call.result().success
    assert "trial stopped: no joint state for 5 s" in call.result().message
    assert len(pipeline.run.metrics()) == 4
    assert 2 <= read_bag(torn).commanded.sum() <= HORIZON + 1  # the zero that stops it, too
    learned = pipeline.run.iteration_file(4).stat().st_mtime_ns

    pipeline.simulator = pipeline.start_simulator()
    pipeline.graph.wait_for(
        lambda: pipeline.graph.trigger("controller/move_to_start").success, "the robot"
    )
    assert pipeline.learn().startswith("iteration 4: trial 005 ")
    assert pipeline.run.iteration_file(4).stat().st_mtime_ns == learned


def test_a_trial_is_cancelled_and_the_robot_stops(pipeline):
    for _ in range(5):
        rows = pipeline.run.metrics_file.read_text()
        call, torn = pipeline.begin_and_wait_for_commands()
        answer, iteration = cancelled(pipeline, call)
        if not answer.message.startswith("too late"):  # a trial in lockstep is soon over
            break
    assert answer.success, answer.message
    assert answer.message.endswith("was cancelled (trial); the run is as it was")
    assert iteration.message.startswith("cancelled: controller/run_trial refused: trial stopped")
    assert 2 <= read_bag(torn).commanded.sum() <= HORIZON + 1
    assert pipeline.run.metrics_file.read_text() == rows


def test_a_learner_killed_in_mid_trial_finds_the_trial_on_disk(pipeline):
    begun = len(pipeline.run.metrics())
    bag = pipeline.begin_and_wait_for_commands()[1]
    pipeline.learner.kill()

    def is_whole():
        try:
            return read_bag(bag).rollout(Joints(LEFT_ARM), HORIZON)
        except BagError:
            return None

    recorded = pipeline.graph.wait_for(is_whole, "the end of the trial")
    pipeline.learner = pipeline.start_learner(f"ready for iteration {begun + 1}")
    assert pipeline.run.metrics()[begun].trial == int(bag.name)
    # The recorder is still at it; the next iteration ends that first.
    assert pipeline.learn().startswith(f"iteration {begun + 1}: ")
    np.testing.assert_array_equal(
        read_bag(bag).rollout(Joints(LEFT_ARM), HORIZON).states, recorded.states
    )
