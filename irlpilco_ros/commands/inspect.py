"""`irlpilco inspect`: what is in a bag, or in the bags of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.bag_topic import add_topic_argument

EPILOG = """\
It shows the recorded joints, the number of samples and commands, the time between samples and
what is missing. A bag that was torn off by a crash is read up to the tear; the bag is only read.
Of a run, or another folder of bags, it shows a line for each bag.

examples:
  irlpilco inspect runs/demo/trials/000      a bag is a folder
  irlpilco inspect runs/demo/trials/000/000_0.mcap
  irlpilco inspect runs/demo                 all bags of a run
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "inspect",
        help="say what is in a bag",
        description="Say what is in a bag: joints, samples, cadence, whether it is whole.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="the bag's folder or file, or a run")
    add_topic_argument(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the summary of the bag."""
    from irlpilco_ros.experience.inspect import inspect

    print(inspect(arguments.bag, arguments.joint_states_topic))
    return 0
