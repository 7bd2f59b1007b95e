"""`irlpilco check`: whether a robot is such that it can be learned on."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.number_options import whole

EPILOG = """\
It listens to the robot for a few seconds and says line by line what is right and what is not: joint
states, who else commands the robot, who would hear a command, and its posture. Nothing moves, but
with --nudge: then each joint goes 0.01 rad (0.01 m if it slides) towards the middle of its range
and back, one after the other, watched as in every motion, and it is told what it makes of its
commands, how late, and whether it stops when none come (the first joint, which then goes up to
0.03 rad). Keep a hand on the emergency stop.

exit code: 0 if all is right, 1 if something is not

examples:
  irlpilco check --robot my_robot.yaml
  irlpilco check --robot my_robot.yaml --nudge      the robot moves!
  irlpilco check --robot my_robot.yaml -r velocity_controller/commands:=other_controller/commands
  irlpilco check --robot config/baxter.yaml --namespace /robot --seconds 10
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "check",
        help="say whether a robot is ready to be learned on",
        description="Listen to a running robot, and say what is right and what is not.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--robot", type=Path, required=True, metavar="YAML", help="the robot's parameters file"
    )
    parser.add_argument("--nudge", action="store_true", help="move each joint by 0.01 rad, too")
    parser.add_argument(
        "--seconds",
        type=whole(1, 3600),
        default=3,
        metavar="S",
        help="for how long to listen (default: 3)",
    )
    parser.add_argument(
        "--namespace", default="", metavar="NS", help="namespace of the robot, such as /robot"
    )
    parser.add_argument(
        "-r",
        "--remap",
        action="append",
        default=[],
        metavar="FROM:=TO",
        help="another name of a topic, as the controller is given it",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print what was found; return 1 if something is wrong."""
    from irlpilco_ros.commands.settings_files import read_robot_settings
    from irlpilco_ros.control.controller_settings import ControllerSettings
    from irlpilco_ros.control.finding import Finding
    from irlpilco_ros.experience.parameters_file import (
        load_parameters_file,
        settings_from_parameters,
    )
    from irlpilco_ros.learning.errors import InvalidSettingError
    from irlpilco_ros.ros.robot_watch import RobotWatch
    from irlpilco_ros.ros.session import Session

    robot = read_robot_settings(arguments.robot)
    values = load_parameters_file(arguments.robot, "controller")
    settings = settings_from_parameters(ControllerSettings, values)
    if arguments.nudge and robot.command_interface != "velocity":
        raise InvalidSettingError(
            f"{arguments.robot} is of a robot that takes efforts; --nudge commands velocities"
        )
    wrong = count = 0

    def show(finding: Finding) -> None:
        nonlocal wrong, count
        wrong, count = wrong + (not finding.is_right), count + 1
        print(finding, flush=True)

    for doubt in robot.doubts():
        show(Finding(False, f"file: {doubt}"))
    with Session("irlpilco_check", arguments.namespace, arguments.remap) as session:
        watch = RobotWatch(session, robot, settings, arguments.nudge)
        for finding in watch.listen(arguments.seconds):
            show(finding)
        if arguments.nudge:
            for finding in watch.nudge():
                show(finding)
    print(f"{wrong} of {count} are wrong" if wrong else "all right")
    return 1 if wrong else 0
