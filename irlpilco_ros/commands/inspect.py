"""`irlpilco inspect`: what is in a bag, or in the bags of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.bag_topic import add_topic_argument, add_window_argument

EPILOG = """\
It shows the recorded joints, the number of samples and commands, the time between samples and
what is missing. A bag that was torn off by a crash is read up to the tear; the bag is only read.
Of a run, or another folder of bags, it shows a line for each bag.

With --robot it also says what that robot can learn from the bag: whether it is refused as a
demonstration, and why, else its motion and how good a recording it is. It is judged at the pace at
which it will be learned from, the control_period of --settings, or else of the robot's file.

examples:
  irlpilco inspect runs/demo/trials/000      a bag is a folder
  irlpilco inspect runs/demo/trials/000/000_0.mcap
  irlpilco inspect runs/demo                 all bags of a run
  irlpilco inspect recordings/000 --robot config/baxter.yaml
  irlpilco inspect recordings/000 --robot my_robot.yaml --settings my_learner.yaml
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
    parser.add_argument(
        "--robot",
        type=Path,
        metavar="FILE",
        help="parameters file of the robot that is to learn from the bag",
    )
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="parameters file of the learner (default, with --robot: the package's "
        "config/sweep.yaml)",
    )
    add_window_argument(parser)
    add_topic_argument(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the summary of the bag."""
    from irlpilco_ros.commands.settings_files import pace_sentence, read_settings
    from irlpilco_ros.experience.bag_files import is_bag
    from irlpilco_ros.experience.inspect import inspect
    from irlpilco_ros.learning.errors import InvalidSettingError

    window = tuple(arguments.demonstration_window)
    if arguments.robot is None and (arguments.settings or window):
        raise InvalidSettingError(
            "--settings and --demonstration-window say how a robot learns from the bag; name its "
            "parameters file, too, with --robot"
        )
    robot = read_settings(arguments)[0] if arguments.robot else None
    print(inspect(arguments.bag, arguments.joint_states_topic, robot, window))
    if robot is not None and is_bag(arguments.bag):
        print(pace_sentence(arguments, robot))
    return 0
