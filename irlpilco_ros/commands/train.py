"""`irlpilco train`: learn from bags alone, without a robot and without ROS."""

from __future__ import annotations

import argparse
import dataclasses
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from irlpilco_ros.commands import metrics_table
from irlpilco_ros.commands.bag_topic import add_topic_argument, add_window_argument
from irlpilco_ros.commands.object_place import (
    adapter_of,
    add_place_arguments,
    moved_to,
    settings_of,
)
from irlpilco_ros.commands.settings_files import (
    add_settings_arguments,
    read_settings,
    settings_paths,
)
from irlpilco_ros.commands.terminal import ProgressDisplay, print_notes
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.bag_files import bag_number, bags_in, copy_bag
from irlpilco_ros.experience.bag_reader import read_path
from irlpilco_ros.experience.best_trial import best_sentence
from irlpilco_ros.experience.demonstrations import checked_demonstrations
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.practice import Plan
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.learning_settings import LearningSettings

EPILOG = """\
It computes what the learner node computes when the robot has just done these trials: for each of
them the cost weights, the dynamics model and the policy of the next one. The same bags and
settings give the same policies, bit for bit. Trials come in the natural order of their names,
whatever these are (1, 2, 10, take_a). Bags that hold no whole trial are named and passed over.

Of the demonstration its motion is imitated, from onset to end. One that the robot cannot imitate is
refused before anything is made, as `irlpilco inspect BAG --robot FILE` says beforehand.

OUT, which must be new, becomes a run directory with copies of the bags; if it fails nothing is
left of it. `irlpilco report OUT` shows it, a learner started on it goes on with the next trial, and
OUT/policy_KKK.yaml runs without a learner; OUT/best_policy.yaml is that of the best trial.

examples:
  irlpilco train --demonstration runs/demo/demonstration --trials runs/demo/trials
  irlpilco train --demonstration runs/demo/demonstration --trials runs/demo/trials \\
      --settings config/thesis.yaml --run-directory runs/thesis
  irlpilco train --demonstration runs/demo/demonstration --trials runs/demo/trials \\
      --object-pose 0.05 -0.03 0.2       the policy for another place of the object
  ros2 run irlpilco_ros controller --ros-args --params-file runs/train/policy_007.yaml
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "train",
        help="learn from bags, without a robot",
        description="Learn from a demonstration and trials in bags.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--demonstration",
        type=Path,
        required=True,
        metavar="BAG",
        help="bag to imitate, or folder of several bags that show the same task",
    )
    parser.add_argument(
        "--trials", type=Path, required=True, metavar="DIR", help="folder of the trials' bags"
    )
    parser.add_argument(
        "--run-directory",
        type=Path,
        default=Path("runs/train"),
        metavar="OUT",
        help="where the result goes; must be new (default: runs/train)",
    )
    add_place_arguments(parser)
    add_window_argument(parser)
    add_topic_argument(parser)
    add_settings_arguments(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Learn from all trials, one after the other, and print a row for each."""
    robot, settings = read_settings(arguments)
    topic, window = arguments.joint_states_topic, tuple(arguments.demonstration_window)
    shown = checked_demonstrations(arguments.demonstration, robot, topic, window)
    bags = whole_trials(arguments.trials, robot, shown[0].rollout.steps, topic)
    if os.path.lexists(arguments.run_directory):
        raise RunDirectoryError(
            f"{arguments.run_directory} exists already; name a new folder with --run-directory"
        )
    try:
        policy = learn(arguments, robot, settings, bags)
    except BaseException:
        # All that is in there are copies and what can be computed again.
        shutil.rmtree(arguments.run_directory, ignore_errors=True)
        raise
    print(f"policy for the next trial: {policy}")
    return 0


def learn(
    arguments: argparse.Namespace,
    robot: RobotSettings,
    settings: LearningSettings,
    bags: Sequence[Path],
) -> Path:
    """Make the run directory from the bags, and return the file of the next trial's policy."""
    learning = Apprenticeship.open(
        arguments.run_directory,
        arguments.demonstration,
        robot,
        settings,
        arguments.joint_states_topic,
        tuple(arguments.demonstration_window),
    )
    try:
        for line in learning.about_demonstration():
            print(line, file=sys.stderr)
        for note in learning.notes:
            print(note, file=sys.stderr)
        print(metrics_table.header(), flush=True)
        for name, bag in numbers(bags).items():
            prepare(learning)
            copy = learning.directory.trials_directory / name
            copy_bag(bag, copy)
            report = learning.finish(copy)
            print(metrics_table.row(dataclasses.asdict(report.row)), flush=True)
        stays = arguments.object_pose is None and arguments.speed is None
        plan = prepare(learning) if stays else adapt(arguments, learning)
        print(best_sentence(learning.directory))
        return learning.directory.policy_file(plan.iteration.index)
    finally:
        learning.close()


def adapt(arguments: argparse.Namespace, learning: Apprenticeship) -> Plan:
    """Carry what was learned over to a place or speed; say what is expected there."""
    robot_file, _ = settings_paths(arguments)
    begun = learning.directory.configuration()
    adapter = adapter_of(robot_file, begun, settings_of(arguments))
    adapted, sentence = adapter.adapt(learning, moved_to(arguments.object_pose))
    print(sentence)
    return adapted.plan


def whole_trials(folder: Path, robot: RobotSettings, horizon: int, topic: str = "") -> list[Path]:
    """Return the bags in a folder that hold a whole trial, in order; say what is passed over.

    Args:
        folder: Where the bags are.
        robot: The robot whose trials they are.
        horizon: Decisions H of a trial.
        topic: Which topic of joint states to take, where several tell the same joints.

    Raises:
        BagError: there is none; the message says what is wrong with those that are there.
    """
    whole, reasons = [], []
    for bag in bags_in(folder):
        try:
            recorded = read_path(bag, topic, robot.joints)
            recorded.trial(robot.roles, horizon, robot.control_period)
        except BagError as error:
            reasons.append(f"{bag.name}: {error}")
        else:
            whole.append(bag)
    if not whole:
        raise BagError(f"no whole trial in {folder}; {'; '.join(reasons) or 'it has no bags'}")
    for reason in reasons:
        print(f"passed over: {reason}", file=sys.stderr)
    return whole


def numbers(bags: Sequence[Path]) -> dict[str, Path]:
    """Return bags by the names NNN that they have, or get in their order if one has another."""
    if all(bag.name.isdecimal() and bag_number(bag) >= 0 for bag in bags):
        return {bag.name: bag for bag in bags}
    for number, bag in enumerate(bags):
        print(f"{bag.name} is trial {number:03d}")
    return {f"{number:03d}": bag for number, bag in enumerate(bags)}


def prepare(learning: Apprenticeship) -> Plan:
    """Do the learning before the next trial, showing progress and what is to be known of it."""
    with ProgressDisplay(f"iteration {learning.next_index}") as display:
        plan = learning.prepare(
            lambda progress: display.update(progress.stage, progress.fraction, progress.message)
        )
    print_notes(plan.iteration)
    return plan
