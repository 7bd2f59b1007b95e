"""`irlpilco replay`: the robot plays a recorded motion back, without any feedback."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irlpilco_ros.commands.bag_topic import add_topic_argument, add_window_argument
from irlpilco_ros.commands.settings_files import add_settings_arguments, read_settings

if TYPE_CHECKING:
    from irlpilco_ros.experience.robot_settings import RobotSettings
    from irlpilco_ros.experience.shown_motion import ShownMotion

EPILOG = """\
The running controller goes to where the motion begins and sends the speeds at which it was shown,
one set for each control period, whatever comes of it: the baseline of all learning. The robot
moves! The demonstration_recorder records it; how far it was off is printed. Robot and settings are
those that the nodes were started with (default: the simulated Baxter's).

examples:
  irlpilco replay recordings/000
  irlpilco replay recordings/000 --robot my_robot.yaml --out replays
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "replay",
        help="have the running controller play a recorded motion back",
        description="Have the running controller play a recorded motion back.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="bag of the motion")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("replays"),
        metavar="DIR",
        help="folder that gets the recording (default: replays)",
    )
    parser.add_argument(
        "--namespace", default="", metavar="NS", help="namespace of the nodes, such as /robot"
    )
    add_settings_arguments(parser)
    add_window_argument(parser)
    add_topic_argument(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Play it back once, and say how far it was off."""
    from irlpilco_ros.experience.apprenticeship import controller_parameters
    from irlpilco_ros.experience.demonstrations import checked_demonstrations
    from irlpilco_ros.experience.practice import task_of_motions
    from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
    from irlpilco_ros.ros.session import Session
    from irlpilco_ros.ros.trial_runner import TrialRunner

    robot, _ = read_settings(arguments)
    window = tuple(arguments.demonstration_window)
    shown = checked_demonstrations(arguments.bag, robot, arguments.joint_states_topic, window)
    task = task_of_motions(shown, robot)
    parameters = controller_parameters(task, open_loop_policy(task), robot)
    with Session("irlpilco_replay", namespace=arguments.namespace) as session:
        trials = TrialRunner(session.clients, robot.reset_service)
        directory = arguments.out.absolute()
        bag = session.run(trials.run(parameters, directory, lambda stage: print(stage, flush=True)))
    print(f"{bag}: {_judged(bag, robot, shown)}")
    return 0


def _judged(bag: Path, robot: RobotSettings, shown: Sequence[ShownMotion]) -> str:
    """Say how far a replay was from what was shown."""
    import numpy as np

    from irlpilco_ros.experience.apprenticeship import joint_rmse
    from irlpilco_ros.experience.bag_reader import read_bag
    from irlpilco_ros.experience.practice import task_of_motions

    task = task_of_motions(shown, robot)
    trial = read_bag(bag, joints=robot.joints).trial(robot.roles, task.horizon)
    off = np.abs((trial.states - task.reference_states())[:, : len(robot.joints)]).max(axis=0)
    joint = int(off.argmax())
    return (
        f"{joint_rmse(task, trial, robot):.4f} rad off at the decisions (RMS); most "
        f"{off[joint]:.4f} rad, {robot.joints[joint]}"
    )
