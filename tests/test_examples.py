"""The examples run as a reader would run them, and do what they promise."""

import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def test_two_joints_are_learned_from_one_demonstration():
    began = time.monotonic()
    done = subprocess.run(
        [sys.executable, "examples/two_joints.py"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert time.monotonic() - began < 60.0  # 1 s on an idle machine
    lines = done.stdout.splitlines()
    errors = [
        float(re.fullmatch(rf"iteration {k}: (\S+) rad off", line)[1])
        for k, line in enumerate(lines)
    ]
    assert len(errors) >= 4
    assert errors[-1] < errors[0] / 10


def test_the_readme_shows_the_heart_of_the_example():
    example = (ROOT / "examples/two_joints.py").read_text(encoding="utf-8")
    section = (ROOT / "README.md").read_text(encoding="utf-8").split("## As a library\n")[1]
    shown = re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]
    assert "apprenticeship(" in shown
    for line in shown.strip().splitlines():
        assert line in example, line
