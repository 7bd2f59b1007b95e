"""`irlpilco report`: the report of a run."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.terminal import ProgressDisplay

EPILOG = """\
The report is RUN/report/index.html, one file that needs no network, also for a phone: the best
policy and the command that runs it, errors over iterations, each joint's trial and prediction
beside the demonstration, limits and speeds, cost weights, what the model found important, timing,
and, if the robot is the simulated Baxter, pictures of the motion. It is made from the files in RUN;
no node needs to run.

examples:
  irlpilco report                            of runs/demo
  irlpilco report runs/sweep
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "report",
        help="make the report of a run",
        description="Make the report of a run from the files in its directory.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "run_directory",
        type=Path,
        nargs="?",
        default=Path("runs/demo"),
        metavar="RUN",
        help="the run directory (default: runs/demo)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Build the report and print its path."""
    print(f"report: {make_report(arguments.run_directory)}")
    return 0


def make_report(run_directory: Path) -> Path:
    """Build the report of a run with a progress bar and return its path."""
    from irlpilco_ros.report import build_report

    command = shlex.join(["irlpilco", *sys.argv[1:]])
    with ProgressDisplay("report") as display:
        return build_report(run_directory, display.update, command)
