"""`irlpilco learn`: call `/learn_iteration` of a running learner and watch it."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from irlpilco_ros.commands.number_options import whole
from irlpilco_ros.commands.terminal import ProgressDisplay

if TYPE_CHECKING:
    from irlpilco_ros.ros.session import Session

EPILOG = """\
The nodes (learner, controller, demonstration_recorder, and a robot or baxter_simulator) must be
running in this ROS domain, and the learner must know the demonstration. Each call is one pass of
Algorithm 3: learn from all trials so far, then move the robot to the start and try. The robot
moves! Ctrl-C stops watching, not the learner.

examples:
  irlpilco learn                             one iteration
  irlpilco learn --iterations 7
  irlpilco learn --namespace /robot          nodes started with -r __ns:=/robot
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "learn",
        help="have a running learner do one or more iterations",
        description="Call /learn_iteration and show live progress.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--iterations", type=whole(1), default=1, metavar="N", help="how many (default: 1)"
    )
    parser.add_argument(
        "--namespace", default="", metavar="NS", help="namespace of the nodes, such as /robot"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Call the service as often as asked and print each answer."""
    from irlpilco_ros.ros.session import Session

    with Session("irlpilco_learn", namespace=arguments.namespace) as session:
        for _ in range(arguments.iterations):
            print(learn_iteration(session), flush=True)
    return 0


def learn_iteration(session: Session, check: Callable[[], None] | None = None) -> str:
    """Call `learn_iteration` once, showing progress, and return the answer.

    Args:
        session: A node to call with.
        check: Called now and then; what it raises ends the waiting.

    Raises:
        ServiceError: the learner is not there, ended, or says why it could not do it.
    """
    with ProgressDisplay("learning") as display:

        def show() -> None:
            progress = session.progress
            if progress is not None and progress.iteration >= 0:
                stage = f"iteration {progress.iteration}, {progress.stage}"
                display.update(stage, progress.fraction, progress.details())
            if check is not None:
                check()

        return session.trigger("learn_iteration", timeout=None, on_wait=show)
