"""`make faults`: make faults in real nodes, and write docs/reliability.md.

python -m benchmarks.faults [--tries N]
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from pathlib import Path

from benchmarks.faults.workplace import ROOT  # first of all: it knows where the tests are

from benchmarks.faults.learning import in_learning  # isort: skip
from benchmarks.faults.motions import INCURABLE, in_recordings, in_trials  # isort: skip
from benchmarks.faults.table import BAR, Fault, markdown

PAGE = ROOT / "docs" / "reliability.md"

INTRODUCTION = """\
# What happens when something goes wrong

Written by `make faults` (minutes), which starts controller, recorder and learner in processes of
their own, with a robot at 100 Hz in real time, and makes each fault amid a recorded trial.

- *robot stopped after*: from the fault to zero velocity at the robot, on a steady clock: the median
  of the tries, and the longest; {bar:g} s are allowed. A dash: there is nothing to stop.
- *samples lost*: samples that the recorder had said are on disk, and that cannot be read.
- *told*: in the answer of the service that was called, shortened; /diagnostics has it, too.
"""


def main() -> int:
    """Make the faults; return 1 if one of them did not go well."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=__doc__)
    parser.add_argument("--tries", type=int, default=5, metavar="N", help="of each fault")
    parser.add_argument("--page", type=Path, default=PAGE, help="what to write")
    arguments = parser.parse_args()
    faults: list[Fault] = []

    def say(fault: Fault) -> None:
        faults.append(fault)
        print(markdown([fault]).splitlines()[-1], flush=True)

    for part in (in_trials, in_recordings, in_learning):
        part(arguments.tries, say)
    page = f"{INTRODUCTION.format(bar=BAR)}\n{markdown(faults)}\n{_where()}\n"
    arguments.page.write_text(page, encoding="utf-8")
    wrong = [fault.name for fault in faults if not fault.held and fault.name != INCURABLE]
    print(f"did not go well: {', '.join(wrong) or 'none'}", flush=True)
    return 1 if wrong else 0


def _where() -> str:
    first = " and priority over it" if os.nice(0) < 0 else ""
    return (
        f"Measured with {os.cpu_count()} processors ({platform.machine()}), other work of a load "
        f"average of {os.getloadavg()[0]:.0f}{first}, Python {platform.python_version()}, ROS 2 "
        f"{os.environ.get('ROS_DISTRO', 'Jazzy as wheels')}."
    )


if __name__ == "__main__":
    sys.exit(main())
