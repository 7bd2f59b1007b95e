"""How every executable begins: Ctrl-C while it still imports ends it at once, without a word."""

from __future__ import annotations

import importlib
import signal
import sys


def main() -> int:
    """Run the `main` of the module that the first argument names, with the arguments after it."""
    return _run(sys.argv.pop(1))


def irlpilco() -> int:
    """Run the command line `irlpilco`."""
    return _run("irlpilco_ros.cli")


def _run(module: str) -> int:
    """Import a module and run its `main`, which sets handlers of its own before it does anything.

    Until then SIGINT ends the process as it ends any program; Python would print where it was.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    code: int = importlib.import_module(module).main()
    return code


if __name__ == "__main__":
    sys.exit(main())
