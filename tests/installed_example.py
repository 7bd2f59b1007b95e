"""The example of tests/example_plugin as pip installs it, in a folder of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

PLUGIN = Path(__file__).parent / "example_plugin"


def install_example(folder: Path) -> Path:
    """Install the example into a new folder below this one, and return that."""
    target = folder / "site"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", str(target), str(_copy(folder))], check=True)
    return target


def _copy(folder: Path) -> Path:
    """Return a copy of the example, for building leaves files beside the sources."""
    source = folder / "source"
    for file in sorted(PLUGIN.rglob("*")):
        if file.suffix in (".py", ".toml"):
            path = source / file.relative_to(PLUGIN)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(file.read_bytes())
    return source
