"""`irlpilco sweep`: from nothing to the report with nodes that somebody else has started."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from irlpilco_ros.commands.demo_nodes import SERVICES, START_TIMEOUT
from irlpilco_ros.commands.learn import learn_iteration
from irlpilco_ros.commands.number_options import whole
from irlpilco_ros.commands.report import make_report
from irlpilco_ros.commands.showing import show
from irlpilco_ros.commands.terminal import ProgressDisplay
from irlpilco_ros.experience.run_directory import RunDirectory

if TYPE_CHECKING:
    from irlpilco_ros.ros.session import Session

EPILOG = """\
It is what `ros2 launch irlpilco_ros sweep.launch.py` does once its nodes are started. It waits
for them; has the demonstrator show its motion and the recorder record it, unless the learner has a
demonstration already; calls /learn_iteration; and makes the report. The first step that fails ends
it with exit code 1 and one sentence.

It can be called again: the learner goes on with its run, so that N more iterations are learned.
Nothing that was recorded is overwritten. For another run start the learner with another
run_directory.

examples:
  irlpilco sweep
  irlpilco sweep --iterations 3 --namespace /robot
"""

SIMULATED = ("baxter_simulator", "demonstrator")
"""Nodes that are needed only where the motion has to be shown."""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "sweep",
        help="have running nodes demonstrate, learn and report the sweep",
        description="With all nodes running: demonstrate, record, learn and report.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--iterations", type=whole(1), default=7, metavar="N", help="how many (default: 7)"
    )
    parser.add_argument(
        "--namespace", default="", metavar="NS", help="namespace of the nodes, such as /robot"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Do one step after the other."""
    from irlpilco_ros.ros.session import Session

    with Session("irlpilco_sweep", namespace=arguments.namespace) as session:
        needed = {name: calls for name, calls in SERVICES.items() if name not in SIMULATED}
        session.wait_for_nodes(needed, START_TIMEOUT)
        names = ("run_directory", "demonstration")
        where = session.run(session.clients.get_parameters("learner", names))
        directory = RunDirectory(where["run_directory"])
        if not where["demonstration"] and not directory.demonstration_directory.is_dir():
            demonstrate(session, directory)
        for _ in range(arguments.iterations):
            print(learn_iteration(session), flush=True)
    print(f"report: {make_report(directory.path)}")
    return 0


def demonstrate(session: Session, directory: RunDirectory) -> None:
    """Have the motion shown, and tell the learner where its recording is.

    Raises:
        ServiceError: a node is not there or refuses; the message says which and why.
    """
    from irlpilco_ros.ros.clients import ServiceError

    try:
        session.wait_for_nodes({name: SERVICES[name] for name in SIMULATED}, START_TIMEOUT)
    except ServiceError as error:
        raise ServiceError(
            f"the learner has no demonstration, and nobody is there to show one: {error}"
        ) from error
    with ProgressDisplay("demonstration") as display:
        display.update("the motion is shown and recorded", 0.0)
        bag, summary = show(session, directory.path / "recordings")
    print(f"demonstration: {summary}", flush=True)
    session.run(session.clients.set_parameters("learner", {"demonstration": str(bag)}))
