"""`irlpilco inspect`: what is in a bag."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

EPILOG = """\
It shows the recorded joints, the number of samples and commands, the time between samples and
what is missing. A bag that was torn off by a crash is read up to the tear; the bag is only read.

examples:
  irlpilco inspect runs/demo/trials/000      a bag is a folder
  irlpilco inspect runs/demo/trials/000/000_0.mcap
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
    parser.add_argument("bag", type=Path, metavar="BAG", help="the bag's folder or .mcap file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the summary of the bag."""
    from irlpilco_ros.experience.inspect import inspect

    print(inspect(arguments.bag))
    return 0
