"""`irlpilco view`: a run or a bag in the browser, with the robot in 3-D."""

from __future__ import annotations

import argparse
import socket
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irlpilco_ros.commands.bag_topic import add_topic_argument
from irlpilco_ros.commands.number_options import whole
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.learning.errors import InvalidSettingError, IrlPilcoError

if TYPE_CHECKING:
    from irlpilco_ros.view.motions import Motions
    from irlpilco_ros.view.page import Page
    from irlpilco_ros.view.urdf_look import Link

EPILOG = """\
The page has the robot and the demonstration as its ghost, a time slider, play at any speed, and the
motions to choose from; below them how far each joint is off the demonstration, and one joint with
what was predicted of it. It is served to this computer alone, until Ctrl-C. It needs viser:
pip install 'irlpilco_ros[view]', or pip install viser pycollada.

Shapes are those of the URDF that the robot's file names (--robot); of the simulated Baxter it is
known. Mesh files that are not there are left out.

examples:
  irlpilco view runs/demo
  irlpilco view runs/demo --no-browser --port 8123
  irlpilco view recordings/000 --robot my_robot.yaml
  irlpilco view runs/demo --live             follows the robot that runs now, in a trial beside
                                             what was demonstrated
"""


HOST = "127.0.0.1"
DEFAULT_PORT = 8080


class NoViserError(IrlPilcoError):
    """The page cannot be drawn: what draws it is not installed."""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "view",
        help="show a run or a bag in the browser, with the robot in 3-D",
        description="Show a run or a bag in the browser, with the robot in 3-D.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("path", type=Path, metavar="RUN|BAG", help="a run directory, or a bag")
    parser.add_argument(
        "--robot", type=Path, metavar="YAML", help="the robot's parameters file, with its urdf"
    )
    parser.add_argument(
        "--port",
        type=whole(0, 65_535),
        metavar="N",
        help=f"(default: {DEFAULT_PORT}, or the next one that is free; 0: any that is free)",
    )
    parser.add_argument("--no-browser", action="store_true", help="serve it, and open nothing")
    parser.add_argument("--live", action="store_true", help="follow joint_states of running nodes")
    parser.add_argument(
        "--namespace", default="", metavar="NS", help="of the running nodes, such as /robot"
    )
    add_topic_argument(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C."""
    try:
        import viser
    except ImportError as error:
        raise NoViserError(
            "irlpilco view needs viser, which is not there: pip install 'irlpilco_ros[view]', or "
            "pip install viser pycollada"
        ) from error
    from irlpilco_ros.view.page import Page

    motions = _motions(arguments.path, arguments.joint_states_topic)
    links = _links(arguments.robot, arguments.path, motions.joints)
    if arguments.port is not None:
        _check_port(arguments.port)
    wanted = DEFAULT_PORT if arguments.port is None else arguments.port
    server = viser.ViserServer(host=HOST, port=wanted, verbose=False)
    try:
        address = f"http://localhost:{server.get_port()}"
        taken = f"port {wanted} is taken; " if wanted not in (0, server.get_port()) else ""
        print(f"{motions.title}: {address} ({taken}Ctrl-C ends it)", flush=True)
        if not arguments.no_browser:
            webbrowser.open(address)
        page = Page(server, motions, links)  # meshes may take a while: the browser starts meanwhile
        if arguments.live:
            _follow(page, arguments.namespace)
        page.play_for_ever()
    except KeyboardInterrupt:
        print()  # below the ^C
    finally:
        server.stop()
    return 0


def _check_port(port: int) -> None:
    """Check that a port that was asked for can be had: viser would take another one.

    Raises:
        InvalidSettingError: it cannot; says why.
    """
    try:
        socket.create_server((HOST, port)).close()
    except OSError as error:
        raise InvalidSettingError(
            f"port {port} cannot be used: {error.strerror or error}; choose another with --port, "
            "or leave it out: then the next one that is free is taken"
        ) from error


def _motions(path: Path, topic: str) -> Motions:
    from irlpilco_ros.experience.run_directory import RunDirectory
    from irlpilco_ros.view.motions import motions_of_bag, motions_of_run

    if not path.exists():
        raise BagError(f"{path} is not there; expected a run directory or a bag")
    if RunDirectory(path).configuration_file.exists():
        return motions_of_run(path)
    return motions_of_bag(path, topic)


def _links(robot: Path | None, path: Path, joints: tuple[str, ...]) -> tuple[Link, ...]:
    """Return what the robot looks like."""
    from irlpilco_ros.experience.parameters_file import (
        load_parameters_file,
        settings_from_parameters,
    )
    from irlpilco_ros.experience.plain_files import read_text
    from irlpilco_ros.kinematics.tools import ToolSettings
    from irlpilco_ros.resources import config_file, named_file
    from irlpilco_ros.view.urdf_look import links_of

    if robot is None:
        if not set(joints) <= set(load_parameters_file(config_file("baxter.yaml"), "")["joints"]):
            raise InvalidSettingError(
                f"what the robot of {path} looks like is not known; name its parameters file with "
                "--robot (irlpilco robot makes one from a URDF)"
            )
        from sim_bridge.robot_description import scene_urdf

        return links_of(scene_urdf())
    values = load_parameters_file(robot, "learner")
    urdf = settings_from_parameters(ToolSettings, values).urdf
    if not urdf:
        raise InvalidSettingError(f"{robot} names no urdf; add it, as config/baxter.yaml does")
    source = named_file(urdf)
    return links_of(read_text(source, 1 << 24), source.parent)


def _follow(page: Page, namespace: str) -> None:
    """Show the running robot until Ctrl-C."""
    from irlpilco_ros.ros.live_robot import LiveRobot
    from irlpilco_ros.ros.session import Session

    with Session("irlpilco_view", namespace=namespace) as session:
        robot = LiveRobot(session)
        page.play_for_ever(lambda: robot.tell(page.follow))
