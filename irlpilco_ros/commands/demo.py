"""`irlpilco demo`: the whole of it, from the demonstration to the report, on a simulated Baxter."""

from __future__ import annotations

import argparse
import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irlpilco_ros.commands import metrics_table
from irlpilco_ros.commands.demo_nodes import (
    SERVICES,
    START_TIMEOUT,
    add_robot_arguments,
    check_simulation,
    node_environment,
    start_nodes,
)
from irlpilco_ros.commands.learn import learn_iteration
from irlpilco_ros.commands.moved import MovedDemo, add_moved_arguments
from irlpilco_ros.commands.node_processes import NodeProcesses
from irlpilco_ros.commands.number_options import LARGEST_SEED, whole
from irlpilco_ros.commands.report import make_report
from irlpilco_ros.commands.ros_domain import enter_private_domain
from irlpilco_ros.commands.run_folder import keep_previous
from irlpilco_ros.commands.settings_files import add_settings_arguments, read_settings
from irlpilco_ros.commands.showing import show
from irlpilco_ros.commands.terminal import ProgressDisplay, print_notes
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.best_trial import best_sentence
from irlpilco_ros.experience.metrics import DEMONSTRATION, MetricsRow
from irlpilco_ros.experience.moved_table import read_moves
from irlpilco_ros.experience.run_directory import RunDirectory

if TYPE_CHECKING:
    from irlpilco_ros.ros.session import Session

EPILOG = """\
It starts baxter_simulator, demonstrator, demonstration_recorder, controller and learner, each in
a process of its own and in a ROS domain of their own (or ROS_DOMAIN_ID, if set); has the sweep
demonstrated and recorded; replays the demonstration's speeds blindly, as the baseline; calls
/learn_iteration seven times; and makes the report. While it runs, other shells can look on with
ROS_DOMAIN_ID set to the number that it prints. The nodes' logs are in RUN/log.

A run that is already there is kept: runs/demo becomes runs/demo.1, .2, ...; a folder that holds
anything else is refused.

examples:
  irlpilco demo
  irlpilco demo --seed 3
  irlpilco demo --settings config/thesis.yaml --position-margin -0.5 --run-directory runs/thesis
  irlpilco demo --preset delayed             a robot that runs 0.4 s behind
  irlpilco demo --robot miscalibrated        joints that make 0.6 to 1.2 times the commanded speed
  irlpilco demo --control-period 0.1         ten decisions a second
  irlpilco demo --moved config/places.yaml    then move the pile, and sweep there
  irlpilco demo --real-time-factor 1         watch it at the robot's own speed
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "demo",
        help="demonstrate, learn and report a sweep on a simulated Baxter",
        description="Teach a simulated Baxter to sweep, with all nodes, and report how it went.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--seed",
        type=whole(0, LARGEST_SEED),
        default=0,
        metavar="N",
        help="of sensor noise and learning (default: 0)",
    )
    parser.add_argument(
        "--iterations", type=whole(0), default=7, metavar="N", help="how many (default: 7)"
    )
    parser.add_argument(
        "--run-directory",
        type=Path,
        default=Path("runs/demo"),
        metavar="RUN",
        help="where everything goes (default: runs/demo)",
    )
    add_settings_arguments(parser)
    add_robot_arguments(parser)
    add_moved_arguments(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Do it all; the nodes are stopped in the end, whatever happens."""
    # Wrong files and a missing rclpy are found before anything is started or moved.
    from irlpilco_ros.ros.session import Session

    read_settings(arguments)
    check_simulation(arguments)
    if arguments.moved is not None:
        read_moves(arguments.moved)
    directory = RunDirectory(arguments.run_directory)
    kept = keep_previous(directory.path)
    if kept is not None:
        print(f"the run that was in {arguments.run_directory} is kept in {kept}")
    domain = enter_private_domain(os.environ)
    print(f"run directory {directory.path}, ROS_DOMAIN_ID {domain}", flush=True)
    environment = node_environment(directory.path)
    with NodeProcesses(directory.path / "log", environment) as nodes:
        start_nodes(nodes, arguments, directory.path)
        with Session("irlpilco_demo") as session:
            demo = Demo(arguments, directory, session, nodes.check)
            elsewhere = moved_demo(arguments, demo, session, nodes.check)
            demo.run()
            if elsewhere is not None:
                elsewhere.run()
    print(f"report: {make_report(directory.path)}")
    return 0


def moved_demo(
    arguments: argparse.Namespace, demo: Demo, session: Session, check: Callable[[], None]
) -> MovedDemo | None:
    """Return what goes on at other places, if that is asked for; wrong files are found now."""
    if arguments.moved is None:
        return None
    return MovedDemo(arguments, demo.directory, session, check, demo.learn)


class Demo:
    """The demo once its nodes have been started."""

    def __init__(
        self,
        arguments: argparse.Namespace,
        directory: RunDirectory,
        session: Session,
        check: Callable[[], None],
    ) -> None:
        """Do nothing yet.

        Args:
            arguments: The command line.
            directory: The run directory, new.
            session: A node to call the others with.
            check: Raises if one of the nodes has ended.
        """
        from irlpilco_ros.ros.trial_runner import TrialRunner

        self._arguments = arguments
        self.directory = directory
        self._session = session
        self._check = check
        self._trials = TrialRunner(session.clients)

    def run(self) -> None:
        """Demonstrate, replay, learn; one printed row per trial."""
        with ProgressDisplay("demo") as display:
            display.update("start the nodes", 0.0)
            self._session.wait_for_nodes(SERVICES, START_TIMEOUT, self._check)
            display.update("demonstration", 0.3)
            recordings = self.directory.path / "recordings"
            demonstration, summary = show(self._session, recordings, self._check)
            display.update("replay of the demonstration", 0.6)
            replay = self._replay(demonstration)
        print(f"demonstration: {summary}")
        print(metrics_table.header())
        shown = self.directory.baseline_metrics(DEMONSTRATION)
        for row in filter(None, (shown, replay)):
            _print_row(row)
        parameters = {"demonstration": str(demonstration)}
        self._session.run(self._session.clients.set_parameters("learner", parameters), self._check)
        printed = 0
        for _ in range(self._arguments.iterations):
            self.learn()
            rows = self.directory.metrics()
            for row in rows[printed:]:
                _print_row(row)
                if row.iteration:
                    print_notes(self.directory.read_iteration(row.iteration))
            printed = len(rows)
        print(best_sentence(self.directory))

    def learn(self) -> None:
        """Learn one iteration; arms that a wild trial has hooked into each other are freed once."""
        from irlpilco_ros.ros.clients import RefusedError

        try:
            learn_iteration(self._session, self._check)
        except RefusedError as error:
            if "move to start stopped" not in str(error):
                raise
            print(f"{error}\nthe arms are freed, as a person would do it (baxter_simulator/reset)")
            self._session.trigger("baxter_simulator/reset", 10.0, self._check)
            learn_iteration(self._session, self._check)

    def _replay(self, demonstration: Path) -> MetricsRow:
        """Replay the demonstration's own speeds, the baseline of all learning."""
        robot, settings = read_settings(self._arguments)
        settings = dataclasses.replace(settings, seed=self._arguments.seed)
        run = Apprenticeship.open(self.directory.path, demonstration, robot, settings)
        try:
            trial = self._trials.run(
                run.replay_parameters(), run.directory.replay_directory, lambda stage: None
            )
            return run.finish_replay(self._session.run(trial, self._check))
        finally:
            run.close()


def _print_row(row: MetricsRow) -> None:
    print(metrics_table.row({**dataclasses.asdict(row), "iteration": row.name}), flush=True)
