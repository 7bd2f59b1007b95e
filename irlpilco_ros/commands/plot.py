"""`irlpilco plot`: joints over time, of bags on top of each other."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irlpilco_ros.learning.errors import InvalidSettingError

if TYPE_CHECKING:
    from irlpilco_ros.experience.episodes import Episode

EPILOG = """\
A panel for each joint, with its position since each recording began. The file's ending says what it
becomes: .png, .svg or .pdf.

examples:
  irlpilco plot recordings/000 --out joints.png
  irlpilco plot runs/demo/demonstration runs/demo/trials/003 --joints 'left_*' --out left.svg
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "plot",
        help="draw the joints of bags over time",
        description="Draw the joints of one or several bags over time.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bags", type=Path, nargs="+", metavar="BAG", help="bags' folders")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="picture to write")
    parser.add_argument(
        "--joints",
        nargs="+",
        default=["*"],
        metavar="NAME",
        help="names or patterns (default: all)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the picture."""
    from irlpilco_ros.experience.episodes import episodes_of_run
    from irlpilco_ros.report.bag_figure import bag_figure

    out: Path = arguments.out
    if out.exists():
        raise InvalidSettingError(f"{out} is there already; name a new file, or remove it first")
    episodes = [each for bag in arguments.bags for each in _named(bag, episodes_of_run(bag))]
    joints = _chosen(arguments.joints, episodes)
    figure = bag_figure(episodes, joints)
    try:
        figure.savefig(out, dpi=150)
    except ValueError as error:  # an ending that means nothing
        raise InvalidSettingError(f"{out} cannot be drawn: {error}") from error
    print(f"{out}: {len(joints)} joints of {len(episodes)} recordings")
    return 0


def _named(path: Path, episodes: Sequence[Episode]) -> list[Episode]:
    """Return recordings with names that tell those of several bags and runs apart."""
    if len(episodes) == 1:
        return [dataclasses.replace(episodes[0], name=str(path))]
    return [dataclasses.replace(each, name=f"{path} {each.name}") for each in episodes]


def _chosen(patterns: Sequence[str], episodes: Sequence[Episode]) -> list[str]:
    known = dict.fromkeys(joint for episode in episodes for joint in episode.joints)
    chosen = [joint for joint in known if any(fnmatchcase(joint, each) for each in patterns)]
    if not chosen:
        raise InvalidSettingError(
            f"no joint is called {' or '.join(patterns)}; recorded are {', '.join(known)}"
        )
    return chosen
