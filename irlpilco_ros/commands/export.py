"""`irlpilco export`: a run's recordings for other tools."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from irlpilco_ros.learning.errors import InvalidSettingError, IrlPilcoError

EPILOG = """\
--csv writes a table for each recording: time, and position, velocity and command of every joint,
at each joint state. --lerobot writes a LeRobot dataset (version 3.0), whose episodes are
demonstrations and trials: the state is the joints' positions, the action what was commanded, or,
where somebody guided the robot, the velocity at which it went. That needs pyarrow: pip install
pyarrow. Both folders are new ones, and the run is only read.

examples:
  irlpilco export runs/demo --csv tables
  irlpilco export runs/demo --lerobot dataset --task sweep
  irlpilco export recordings/000 --csv tables      one bag
"""


class NoPyarrowError(IrlPilcoError):
    """What writes parquet files is not installed."""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "export",
        help="write a run's recordings as CSV or as a LeRobot dataset",
        description="Write the recordings of a run, or a bag, for other tools.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("path", type=Path, metavar="RUN|BAG", help="a run directory, or a bag")
    parser.add_argument("--csv", type=Path, metavar="DIR", help="a new folder for tables")
    parser.add_argument("--lerobot", type=Path, metavar="DIR", help="a new folder for a dataset")
    parser.add_argument(
        "--task",
        default="do what was demonstrated",
        help="what the robot does, in words, for --lerobot",
    )
    parser.add_argument("--robot-type", default="unknown", metavar="NAME", help="for --lerobot")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write what is asked for, and say where it is."""
    from irlpilco_ros.experience.csv_export import write_csv
    from irlpilco_ros.experience.episodes import episodes_of_run
    from irlpilco_ros.experience.lerobot_export import VERSION, write_lerobot

    folders = [each for each in (arguments.csv, arguments.lerobot) if each is not None]
    if not folders:
        raise InvalidSettingError("say what to write: --csv DIR, --lerobot DIR, or both")
    for folder in folders:
        if folder.exists():
            raise InvalidSettingError(f"{folder} is there already; name a new folder")
    if arguments.lerobot is not None:
        _check_pyarrow()
    episodes = episodes_of_run(arguments.path)
    if arguments.csv is not None:
        arguments.csv.mkdir(parents=True)
        print(f"{arguments.csv}: {len(write_csv(arguments.csv, episodes))} tables")
    if arguments.lerobot is not None:
        rate = write_lerobot(arguments.lerobot, episodes, arguments.task, arguments.robot_type)
        print(
            f"{arguments.lerobot}: LeRobot dataset {VERSION}, {len(episodes)} episodes at {rate} Hz"
        )
    return 0


def _check_pyarrow() -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise NoPyarrowError(
            "--lerobot needs pyarrow, which is not there: pip install 'irlpilco_ros[lerobot]', or "
            "pip install pyarrow"
        ) from error
