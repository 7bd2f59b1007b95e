"""Where the configuration files that come with the package are."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from irlpilco_ros.learning.errors import InvalidSettingError


def shipped_file(name: str) -> Path:
    """Return the path of a file that comes with the package, such as "config/sweep.yaml".

    Looks in the source tree, next to the interpreter (after `pip install`) and in the prefixes
    of AMENT_PREFIX_PATH (after `colcon build`).

    Raises:
        InvalidSettingError: it is in none of them; the message lists where it was looked for.
    """
    prefixes = [sys.prefix, *filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(":"))]
    folders = [Path(__file__).resolve().parents[1]]
    folders += [Path(prefix) / "share" / "irlpilco_ros" for prefix in prefixes]
    for folder in folders:
        if (folder / name).exists():
            return folder / name
    looked = ", ".join(str(folder) for folder in folders)
    raise InvalidSettingError(f"{name} was not found in: {looked}. Is irlpilco_ros installed?")
