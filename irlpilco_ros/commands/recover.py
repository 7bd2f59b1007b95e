"""`irlpilco recover`: a whole new bag from one that was torn off."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

EPILOG = """\
A recorder that is killed leaves a bag without metadata.yaml and perhaps half a message at its end.
Every sample before the tear is copied into a new bag beside it, 003.recovered for 003; the torn
bag stays as it is.

examples:
  irlpilco recover runs/demo/trials/003
  irlpilco inspect runs/demo/trials/003      look first; this reads torn bags too
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "recover",
        help="make a whole bag from one that was torn off",
        description="Write a whole new bag with every sample of one that was torn off.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="the torn bag's folder or .mcap file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Recover the bag and print where the new one is."""
    from irlpilco_ros.experience.recovery import recover

    print(f"recovered: {recover(arguments.bag)}")
    return 0
