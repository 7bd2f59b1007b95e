"""`irlpilco train`: learn from bags alone, without a robot and without ROS."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from irlpilco_ros.commands import metrics_table
from irlpilco_ros.commands.terminal import ProgressDisplay

EPILOG = """\
It computes what the learner node would have computed after the last of these trials: the cost
weights, the dynamics model, and the policy for the next trial. The same bags and settings give
the same policy, bit for bit. OUT gets the result as a run directory without that trial; its
policy_KKK.yaml is a parameters file that the controller takes as it is.

examples:
  irlpilco train --demonstration runs/demo/demonstration --trials runs/demo/trials
  irlpilco train --demonstration bags/demonstration --trials bags/trials \\
      --settings config/thesis.yaml --run-directory runs/thesis
  ros2 run irlpilco_ros controller --ros-args --params-file runs/train/policy_007.yaml
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "train",
        help="learn from bags, without a robot",
        description="Learn the next policy from a demonstration and trials in bags.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--demonstration", type=Path, required=True, metavar="BAG", help="bag to imitate"
    )
    parser.add_argument(
        "--trials", type=Path, required=True, metavar="DIR", help="folder of the bags of the trials"
    )
    parser.add_argument(
        "--run-directory",
        type=Path,
        default=Path("runs/train"),
        metavar="OUT",
        help="where the result goes; must be new (default: runs/train)",
    )
    add_settings_arguments(parser)
    parser.set_defaults(run=run)


def add_settings_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --settings and --robot."""
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="parameters file of the learner (default: the package's config/sweep.yaml)",
    )
    parser.add_argument(
        "--robot",
        type=Path,
        metavar="FILE",
        help="parameters file of the robot (default: the package's config/baxter.yaml)",
    )
