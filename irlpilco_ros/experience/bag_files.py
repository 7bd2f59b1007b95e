"""Where bags lie and what they are called: DIR/NNN/NNN_0.mcap, as rosbag2 does it."""

from __future__ import annotations

import re
from pathlib import Path

from irlpilco_ros.experience.durable import sync_directory
from irlpilco_ros.experience.errors import BagError

METADATA = "metadata.yaml"
DISCARDED = ".discarded"
RECOVERED = ".recovered"

_NUMBERED = re.compile(r"(\d{3,})(?:\..*)?")


def bag_number(bag: Path) -> int:
    """Return the number of a bag's folder, -1 if it bears none; suffixes do not count."""
    match = _NUMBERED.fullmatch(bag.name)
    return int(match.group(1)) if match else -1


def make_numbered_folder(directory: Path) -> Path:
    """Make the next folder NNN in a directory, which is made if need be.

    Numbers are never used twice, not even those of discarded bags, and two processes never get
    the same one.

    Raises:
        BagError: the directory cannot be written to.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        while True:
            number = 1 + max((bag_number(entry) for entry in directory.iterdir()), default=-1)
            try:
                return make_folder(directory / f"{number:03d}")
            except FileExistsError:
                continue
    except OSError as error:
        raise BagError(f"cannot make a bag in {directory}: {error}") from error


def make_folder(folder: Path) -> Path:
    """Make a folder that must not exist yet, durably.

    Raises:
        FileExistsError: it exists.
    """
    folder.mkdir()
    sync_directory(folder.parent)
    return folder


def mark_discarded(bag: Path) -> Path:
    """Rename NNN to NNN.discarded, so that nobody learns from it; its data stay.

    Returns:
        Where the bag is now.
    """
    renamed = bag.with_name(bag.name + DISCARDED)
    if renamed.exists():
        raise BagError(f"cannot discard {bag}: {renamed} exists already")
    bag.rename(renamed)
    sync_directory(bag.parent)
    return renamed


def mcap_files(bag: Path) -> list[Path]:
    """Return the .mcap files of a bag's folder in order of recording, or the file that is given.

    Raises:
        BagError: there is no such bag.
    """
    if bag.is_file() and bag.suffix == ".mcap":
        return [bag]
    files = sorted(bag.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
    if not files:
        raise BagError(
            f"{bag} is no MCAP bag; expected a folder with a .mcap file in it, or such a file"
        )
    return files
