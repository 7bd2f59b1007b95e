"""`irlpilco recover`: a whole new bag from one that was torn off."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

EPILOG = """\
A recorder that is killed leaves a bag without metadata.yaml and perhaps half a message at its end.
Everything that is sound is written into a new bag beside it, 003.recovered for 003: messages,
schemas, attachments and metadata records as they were. The old bag stays as it is, and nothing is
ever overwritten.

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
    parser.add_argument("bag", type=Path, metavar="BAG", help="the torn bag's folder or file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Recover the bag and print where the new one is."""
    from irlpilco_ros.experience.recovery import recover

    done = recover(arguments.bag)
    for note in done.notes:
        print(f"found: {note}")
    print(f"recovered: {done.path}, {done.messages} messages")
    return 0
