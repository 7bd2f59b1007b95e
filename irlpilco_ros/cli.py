"""The command `irlpilco`: everything one does with a run, also where there is no `ros2` command."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from types import FrameType

from irlpilco_ros import __version__
from irlpilco_ros.learning.errors import IrlPilcoError

COMMANDS = (
    "demo",
    "sweep",
    "learn",
    "train",
    "adapt",
    "report",
    "view",
    "plot",
    "replay",
    "export",
    "robot",
    "check",
    "inspect",
    "recover",
    "cart-pole",
    "study",
)
"""Names of the commands, each a module of `commands`."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it (128 + SIGINT)."""

TERMINATED = 143
"""Exit code after SIGTERM (128 + SIGTERM)."""


def build_parser(words: Sequence[str] = ()) -> argparse.ArgumentParser:
    """Return the parser with one subparser per command; each sets `run(arguments) -> int`.

    Args:
        words: The command line. If its first word is a command, that alone is made: to import what
            all of them need takes a second.
    """
    parser = argparse.ArgumentParser(
        prog="irlpilco",
        description="One-shot apprenticeship learning for a velocity-controlled robot (IRL/PILCO).",
        epilog="Start with `irlpilco demo`; `irlpilco COMMAND --help` is a page for each command.",
    )
    parser.add_argument("--version", action="version", version=f"irlpilco {__version__}")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in [word for word in words[:1] if word in COMMANDS] or COMMANDS:
        module = import_module(f"irlpilco_ros.commands.{name.replace('-', '_')}")
        module.add_parser(subparsers)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Returns:
        0 if the command did what was asked, 1 if it says on stderr why not, 2 for wrong usage,
        130 after Ctrl-C, 143 after SIGTERM.
    """
    words = sys.argv[1:] if argv is None else argv
    arguments = build_parser(words).parse_args(words)
    signal.signal(signal.SIGTERM, _exit_on_sigterm)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        code: int = arguments.run(arguments)
        sys.stdout.flush()
        return code
    except IrlPilcoError as error:
        print(f"irlpilco: {error}", file=sys.stderr)
        return 1
    except ImportError as error:
        print(f"irlpilco: {_advice(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("irlpilco: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read the output (`| head`) has enough; a second complaint at exit is noise.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"irlpilco: {where}{error.strerror or error}", file=sys.stderr)
        return 1


def _advice(error: ImportError) -> str:
    """Return what to do about a module that is not there, or cannot be loaded."""
    module = (error.name or "").partition(".")[0]
    if module in ("irlpilco_ros", "sim_bridge"):  # a fault in this package is not to be hidden
        raise error
    if not isinstance(error, ModuleNotFoundError):
        reason = (str(error).splitlines() or ["no reason given"])[0]
        return (
            f"a Python module cannot be loaded: {reason}; use the Python for which it was "
            "installed, such as that of the environment that `make` sets up (. .venv/bin/activate)"
        )
    if module == "rclpy" or module.endswith(("_msgs", "_srvs", "_interfaces")):
        return (
            f"this command needs ROS 2, whose Python module {module} is not there; source it "
            "(. /opt/ros/jazzy/setup.bash), or use the environment that `make` sets up "
            "(. .venv/bin/activate)"
        )
    return f"the Python module {module} is not there; install what requirements/ lists"


def _exit_on_sigterm(_signal: int, _frame: FrameType | None) -> None:
    """Unwind, so that whatever the command started is stopped on the way out."""
    raise SystemExit(TERMINATED)


if __name__ == "__main__":
    sys.exit(main())
