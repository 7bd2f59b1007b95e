"""Ctrl-C ends every executable quietly while it is still importing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

EXECUTABLES = sorted(path.name for path in (Path(__file__).parents[1] / "executables").iterdir())
CONSOLE_SCRIPT = "import sys; from irlpilco_ros.entry import irlpilco; sys.exit(irlpilco())"
SLOW = "import time\nprint('importing', flush=True)\ntime.sleep(60.0)\n"


def assert_interrupted(command: list[str], folder: Path, repository: Path) -> None:
    """Interrupt a command while it imports a numpy that takes its time."""
    (folder / "numpy.py").write_text(SLOW)
    path = os.pathsep.join([str(folder), str(repository)])
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "importing\n"
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    printed, complaint = process.communicate(timeout=60.0)
    assert time.monotonic() - began < 30.0, "it ends at once, not when everything is imported"
    assert (printed, complaint) == ("", "")
    assert process.returncode == -signal.SIGINT  # shells make 130 of it


@pytest.mark.parametrize("name", EXECUTABLES)
def test_an_executable_that_is_interrupted_while_it_imports(name, repository, tmp_path):
    lines = (repository / "executables" / name).read_text().splitlines()
    words = lines[-1].removeprefix('exec "$python" ').removesuffix(' "$@"').split()
    assert_interrupted([sys.executable, *words], tmp_path, repository)


def test_the_console_script_that_is_interrupted_while_it_imports(repository, tmp_path):
    assert_interrupted([sys.executable, "-c", CONSOLE_SCRIPT], tmp_path, repository)
