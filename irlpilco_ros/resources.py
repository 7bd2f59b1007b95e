"""Where the files that come with the package are, in a checkout or installed."""

from __future__ import annotations

import os
from pathlib import Path

from irlpilco_ros.learning.errors import IrlPilcoError

PACKAGE = "irlpilco_ros"

IN_PACKAGE = "package://"
"""How a name begins of a file in the share of a ROS package."""


class MissingResourceError(IrlPilcoError, FileNotFoundError):
    """A file that comes with the package is not where any installation puts it."""


def config_directory() -> Path:
    """Return the directory of the parameter files (`baxter.yaml`, `sweep.yaml`, ...).

    In a checkout, and with editable or symlinked installs, that is `config/` beside the package.
    Installed (`pip install`, `colcon build`) it is `share/irlpilco_ros/config` under the
    installation's prefix, which is one of the folders above the package.

    Raises:
        MissingResourceError: there is no such directory; the installation is incomplete.
    """
    return _directory("config", "parameter files")


def recording(name: str) -> Path:
    """Return the path of a bag that comes with the package, such as "cart_pole/expert".

    Raises:
        MissingResourceError: it is not there.
    """
    path = _directory("bags", "recordings") / name
    if not path.is_dir():
        raise MissingResourceError(f"there is no recording {name!r} in {path.parent}")
    return path


def named_file(name: str) -> Path:
    """Return the path of a file that is named by a path, or as package://NAME/FILE.

    The latter is FILE in the share of a ROS package; in a checkout, the files of this package are
    found as well.

    Raises:
        MissingResourceError: there is no such package.
    """
    if not name.startswith(IN_PACKAGE):
        return Path(name)
    package, _, file = name.removeprefix(IN_PACKAGE).partition("/")
    if package == PACKAGE:
        return config_directory().parent / file
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    shares = [Path(prefix) / "share" / package for prefix in prefixes if prefix]
    for share in shares:
        if share.is_dir():
            return share / file
    raise MissingResourceError(
        f"{name}: there is no package {package} in AMENT_PREFIX_PATH; source the workspace that "
        "has it, or name the file by its path"
    )


def _directory(name: str, contents: str) -> Path:
    package = Path(__file__).resolve().parent
    checkout = package.parent
    if (checkout / "package.xml").is_file() and (checkout / name).is_dir():
        return checkout / name
    for prefix in package.parents:
        directory = prefix / "share" / PACKAGE / name
        if directory.is_dir():
            return directory
    raise MissingResourceError(
        f"there is no share/{PACKAGE}/{name} in any folder above {package}; expected the "
        f"{contents} installed with the package: install it again (pip install . or colcon build)"
    )


def config_file(name: str) -> Path:
    """Return the path of one parameter file, such as `config_file("baxter.yaml")`.

    Raises:
        MissingResourceError: no such file; the message lists the names that exist.
    """
    path = config_directory() / name
    if not path.is_file():
        valid = ", ".join(sorted(file.name for file in config_directory().glob("*.yaml")))
        raise MissingResourceError(
            f"there is no parameter file {name!r} in {config_directory()}; available: {valid}"
        )
    return path
