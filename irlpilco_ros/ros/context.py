"""Beginning with ROS: on this computer alone, with errors that a person can read."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.ros.discovery import keep_to_this_host


class RosStartError(IrlPilcoError):
    """ROS cannot begin with the command line or the environment that it was given."""


def begin(argv: Sequence[str] | None = None, context: Context | None = None) -> bool:
    """Initialise rclpy; signals stay with the caller.

    Args:
        argv: Command line with the program's name; None takes sys.argv.
        context: What to initialise; None takes the default context.

    Returns:
        Whether ROS's own SUBNET was narrowed to this computer.

    Raises:
        RosStartError: for example a parameter file that is not there, a remapping that is none, a
            ROS_DOMAIN_ID that is no number, or a keystore that lacks a key.
    """
    narrowed = keep_to_this_host(os.environ)
    with told_in_words():
        rclpy.init(
            args=None if argv is None else list(argv),
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    return narrowed


@contextmanager
def told_in_words() -> Iterator[None]:
    """Have what ROS refuses at its start told in a sentence.

    Raises:
        RosStartError: (from the block) ROS, or the middleware when the first node is made, refuses.
    """
    try:
        yield
    except RuntimeError as error:  # rclpy's RCLError; it has no name in public
        raise RosStartError(f"ROS 2 does not start: {_in_words(error)}") from error


def _in_words(error: RuntimeError) -> str:
    """Return what is wrong, without the lines of C source where it was found."""
    text = re.sub(r", at [^,\s]*\.c(pp)?:\d+", "", str(error))
    return " ".join(text.removeprefix("failed to initialize rcl: ").split())
