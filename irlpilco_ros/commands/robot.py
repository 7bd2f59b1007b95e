"""`irlpilco robot`: a robot's parameters file from its URDF."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.plain_files import read_text
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.resources import IN_PACKAGE, named_file

TEXT_LIMIT = 1 << 24
"""Largest URDF that is read [bytes]."""

PATIENCE = 5.0
"""How long a topic may take to tell a URDF [s]."""

EPILOG = """\
The file has the joints in the order of their chains, position, velocity and effort limits, joints
that turn without end, and a tool at the end of each chain. What the URDF does not say is asked for
in its comments, and here. A URDF that comes from a pipe or a topic is kept beside the file, with
which controller, demonstration_recorder and learner start.

examples:
  irlpilco robot arm.urdf --out my_robot.yaml
  irlpilco robot arm.urdf --out my_robot.yaml --joints joint1 joint2 'wrist_*'
  irlpilco robot - --out my_robot.yaml          xacro arm.xacro | irlpilco robot - ...
  irlpilco robot --from-topic --out my_robot.yaml
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "robot",
        help="make a robot's parameters file from its URDF",
        description="Make a robot's parameters file from its URDF.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "urdf",
        nargs="?",
        metavar="URDF",
        help="the file, package://NAME/FILE, or - for standard input",
    )
    source.add_argument(
        "--from-topic",
        nargs="?",
        const="robot_description",
        metavar="TOPIC",
        help="take it from a topic, as robot_state_publisher tells it (default: robot_description)",
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="YAML", help="the file to write; a new one"
    )
    parser.add_argument(
        "--joints",
        nargs="+",
        default=(),
        metavar="NAME",
        help="joints to learn: names, patterns, chains (default: all that move by themselves)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the file, and say what is in it and what is to be done."""
    from irlpilco_ros.experience.robot_file import chosen_joints, robot_file
    from irlpilco_ros.kinematics.urdf_tree import UrdfTree

    out: Path = arguments.out
    text, where = _description(arguments)
    tree = UrdfTree(text)
    joints = chosen_joints(tree, arguments.joints)
    kept = out.with_suffix(".urdf")
    made = robot_file(tree, joints, where or str(_plain(kept)), _told(arguments))
    if not where:
        _write(kept, text)
    _write(out, made.text)
    print(f"{out}: {len(joints)} joints of {tree.name}")
    for chain in made.chains:
        end = f"; tool: {chain.end}" if chain.end else ""
        print(f"  {chain.name}: {', '.join(joint.name for joint in chain.joints)}{end}")
    print("the URDF does not say:")
    for question in made.questions:
        print(f"  {question}")
    print(f"then, with the robot running: irlpilco check --robot {out}")
    return 0


def _description(arguments: argparse.Namespace) -> tuple[str, str]:
    """Return the URDF, and the name by which it is found; "" if it is no file yet."""
    if arguments.from_topic:
        from irlpilco_ros.ros.description_topic import description_of
        from irlpilco_ros.ros.session import Session

        with Session("irlpilco_robot") as session:
            return description_of(session, arguments.from_topic, PATIENCE), ""
    if arguments.urdf == "-":
        return sys.stdin.read(), ""
    path = named_file(arguments.urdf)
    name = arguments.urdf if arguments.urdf.startswith(IN_PACKAGE) else str(_plain(path))
    return read_text(path, TEXT_LIMIT), name


def _plain(path: Path) -> Path:
    """Return the absolute path without any `..`; symbolic links stay where they can."""
    folder = path.parent.absolute()
    plain = Path(os.path.normpath(folder))
    same = plain.exists() and folder.exists() and plain.samefile(folder)
    return (plain if same else folder.resolve()) / path.name


def _told(arguments: argparse.Namespace) -> str:
    source = f"--from-topic {arguments.from_topic}" if arguments.from_topic else arguments.urdf
    joints = " ".join(["", "--joints", *arguments.joints]) if arguments.joints else ""
    return f"irlpilco robot {source} --out {arguments.out}{joints}"


def _write(path: Path, text: str) -> None:
    if path.exists():
        raise InvalidSettingError(f"{path} is there already; name a new file, or remove it first")
    write_atomically(path, text.encode())
