"""Which topic of joint states a command takes of a bag."""

from __future__ import annotations

import argparse


def add_topic_argument(parser: argparse.ArgumentParser) -> None:
    """Add --joint-states-topic."""
    parser.add_argument(
        "--joint-states-topic",
        default="",
        metavar="TOPIC",
        help="topic of joint states to take of a bag where several tell the same joints",
    )
