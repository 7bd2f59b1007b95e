"""What a command takes of a bag: which topic of joint states, and which part of its time."""

from __future__ import annotations

import argparse

from irlpilco_ros.commands.number_options import real

LONGEST = 1e6
"""Of a recording [s]."""


def add_topic_argument(parser: argparse.ArgumentParser) -> None:
    """Add --joint-states-topic."""
    parser.add_argument(
        "--joint-states-topic",
        default="",
        metavar="TOPIC",
        help="topic of joint states to take of a bag where several tell the same joints",
    )


def add_window_argument(parser: argparse.ArgumentParser) -> None:
    """Add --demonstration-window."""
    parser.add_argument(
        "--demonstration-window",
        type=real(0.0, LONGEST),
        nargs=2,
        default=(),
        metavar=("BEGIN", "END"),
        help="part of the demonstration to imitate, since its first sample [s] (default: its "
        "motion, without what stands still before and after it)",
    )
