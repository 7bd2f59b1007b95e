"""`irlpilco adapt`: a policy of a run for another place of its object, or another speed."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.number_options import as_set
from irlpilco_ros.commands.object_place import (
    adapter_of,
    add_place_arguments,
    moved_to,
    settings_of,
)
from irlpilco_ros.commands.terminal import ProgressDisplay
from irlpilco_ros.experience.adapting import AdaptSettings
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.run_directory import WINDOW, RunDirectory
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import declarations, from_values
from irlpilco_ros.resources import config_file

EPILOG = """\
The demonstration is carried over with its object: the tools go their ways as the object sees them,
and a policy for that is searched in the model of all trials of the run, wherever they were made.
With --speed it is done faster or slower than it was shown, there or where the run is. A place that
is out of reach, a speed that a joint cannot do, or what the model does not vouch for, is refused,
and nothing is written.

What is practised next is practised there: a learner started on RUN goes on with a trial at that
place and speed, and RUN/policy_KKK.yaml runs without one. `--object-pose 0 0 0` goes back.

examples:
  irlpilco adapt runs/demo --object-pose 0.05 -0.03 0.2
  irlpilco adapt runs/demo --object-pose 0 0 0
  irlpilco adapt runs/demo --speed 1.3
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "adapt",
        help="carry a run over to where its object is now, or to another speed",
        description="Carry a run over to another place of its object, or speed, without a trial.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("run_directory", type=Path, metavar="RUN", help="the run directory")
    add_place_arguments(parser)
    parser.add_argument(
        "--robot",
        type=Path,
        metavar="FILE",
        help="parameters file of the robot, with its tools (default: the package's "
        "config/baxter.yaml)",
    )
    limit = declarations(AdaptSettings)["adapt_error_limit"]
    parser.add_argument(
        "--error-limit",
        type=as_set(AdaptSettings, "adapt_error_limit"),
        default=limit.default,
        metavar="RAD",
        help=f"largest predicted error that is accepted (default: {limit.default:g})",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Adapt, and print what is expected of the policy and where it is."""
    if arguments.object_pose is None and arguments.speed is None:
        raise InvalidSettingError("nothing to adapt to; give --object-pose, --speed or both")
    directory = RunDirectory(arguments.run_directory)
    begun = directory.configuration()
    accepted = settings_of(arguments, adapt_error_limit=arguments.error_limit)
    adapter = adapter_of(arguments.robot or config_file("baxter.yaml"), begun, accepted)
    run = Apprenticeship.open(
        directory.path,
        None,
        adapter.robot,
        from_values(LearningSettings, begun),
        str(begun.get("joint_states_topic", "")),
        tuple(begun.get(WINDOW, ())),
    )
    try:
        with ProgressDisplay("adapt") as display:
            adapted, sentence = adapter.adapt(
                run,
                moved_to(arguments.object_pose),
                lambda progress: display.update(
                    progress.stage, progress.fraction, progress.message
                ),
            )
        print(sentence)
        print(f"policy: {directory.policy_file(adapted.plan.iteration.index)}")
    finally:
        run.close()
    return 0
