"""Where bags lie and what they are called: DIR/NNN/NNN_0.mcap, as rosbag2 does it."""

from __future__ import annotations

import os
import re
import shutil
import uuid
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from irlpilco_ros.experience.durable import sync_directory, sync_tree
from irlpilco_ros.experience.errors import BagError, UnreadableBagError

METADATA = "metadata.yaml"
DISCARDED = ".discarded"
RECOVERED = ".recovered"
DAMAGED = ".damaged"

STORAGE_SUFFIXES = (".mcap", ".db3", ".bag", ".mcap.zstd", ".db3.zstd")
"""How the files end that hold messages: MCAP, SQLite, ROS 1, and both of rosbag2's compressed."""

_NUMBERED = re.compile(r"(\d{3,})(?:\..*)?")
_MARKED = re.compile(rf".*({DISCARDED}|{RECOVERED}|{DAMAGED})(\.\d+)?")


def bag_number(bag: Path) -> int:
    """Return the number of a bag's folder, -1 if it bears none; suffixes do not count."""
    match = _NUMBERED.fullmatch(bag.name)
    return int(match.group(1)) if match else -1


def natural_order(path: Path) -> list[tuple[int, int, str]]:
    """Return a key that sorts names as people do: numbers by value, 2 before 10."""
    words = re.findall(r"\d+|\D+", path.name)
    return [(0, int(word), word) if word.isdecimal() else (1, 0, word) for word in words]


def entries(folder: Path) -> list[Path]:
    """Return what is in a folder in natural order, but for what is hidden.

    Raises:
        BagError: it cannot be read.
    """
    try:
        visible = [entry for entry in folder.iterdir() if not entry.name.startswith(".")]
    except OSError as error:
        raise BagError(f"cannot read {folder}: {error.strerror}") from error
    return sorted(visible, key=natural_order)


def storage_files(bag: Path) -> list[Path]:
    """Return the files of a bag that hold messages, in natural order.

    Args:
        bag: The bag's folder, or its only file.

    Raises:
        UnreadableBagError: there is no such bag.
    """
    if os.path.isdir(bag):
        files = [entry for entry in entries(bag) if entry.name.endswith(STORAGE_SUFFIXES)]
    else:
        files = [bag] if os.path.exists(bag) and bag.name.endswith(STORAGE_SUFFIXES) else []
    if not files:
        found = "is no bag" if os.path.exists(bag) else "is not there"
        raise UnreadableBagError(
            f"{bag} {found}; expected a folder with a file {', '.join(STORAGE_SUFFIXES)} in it, or "
            "such a file"
        )
    return files


def is_bag(path: Path) -> bool:
    """Whether there is a file here that holds messages, readable or not."""
    try:
        return bool(storage_files(path))
    except BagError:
        return False


def bags_in(folder: Path) -> list[Path]:
    """Return the bags in a folder, in natural order of their names: 1, 2, 10, take_a, take_b.

    They may be called anything. Those that are marked as discarded, recovered or damaged are left
    out.

    Raises:
        BagError: the folder cannot be read.
    """
    return [bag for bag in entries(folder) if is_bag(bag) and not _MARKED.fullmatch(bag.name)]


def numbered_bags(directory: Path) -> list[tuple[int, Path]]:
    """Return number and path of the bags NNN that the recorder made in a directory, in order.

    Discarded, damaged and recovered bags, whose names have a suffix, are left out.
    """
    if not os.path.isdir(directory):
        return []
    return sorted(
        (bag_number(entry), entry)
        for entry in entries(directory)
        if entry.name.isdecimal() and bag_number(entry) >= 0 and os.path.isdir(entry)
    )


def make_hidden_folder(parent: Path) -> Path:
    """Make a folder for a bag that has no name yet; `publish` gives it one."""
    hidden = parent / f".{uuid.uuid4().hex}.tmp"
    hidden.mkdir()
    return hidden


def publish(hidden: Path, folder: Path) -> Path:
    """Give a bag its name, when all that it holds is on disk; an existing one is never replaced.

    Raises:
        FileExistsError: the name is taken.
    """
    if os.path.lexists(folder):
        raise FileExistsError(f"{folder} exists already")
    sync_tree(hidden)
    # Where another process was faster, its bag is not empty, and a folder replaces none but those.
    os.rename(hidden, folder)
    sync_directory(folder.parent)
    return folder


def next_number(directory: Path) -> int:
    """Return the next free number of a bag: none is used twice, not even those of marked bags."""
    return 1 + max((bag_number(entry) for entry in directory.iterdir()), default=-1)


def first_free(names: Iterator[Path]) -> Path:
    """Return the first name that nothing bears yet."""
    return next(name for name in names if not os.path.lexists(name))


def mark(bag: Path, suffix: str) -> Path:
    """Rename NNN to NNN + suffix, so that nobody learns from it; its data stay.

    Returns:
        Where the bag is now.

    Raises:
        BagError: that is taken, or the bag cannot be renamed.
    """
    renamed = bag.with_name(bag.name + suffix)
    if os.path.lexists(renamed):
        raise BagError(f"cannot rename {bag}: {renamed} exists already")
    try:
        bag.rename(renamed)
        sync_directory(bag.parent)
    except OSError as error:
        raise BagError(f"cannot rename {bag}: {error.strerror}") from error
    return renamed


def mark_discarded(bag: Path) -> Path:
    """Mark a bag as discarded by its user; arguments and errors as `mark`."""
    return mark(bag, DISCARDED)


def copy_bag(bag: Path, folder: Path) -> None:
    """Copy a bag, its folder or its only file, into a new folder; what is no file stays behind.

    Raises:
        BagError: it cannot be read or written.
    """
    files = [bag] if not os.path.isdir(bag) else entries(bag)
    try:
        folder.mkdir(parents=True)
        for file in files:
            if file.is_file():
                shutil.copy2(file, folder)
    except OSError as error:
        raise BagError(f"cannot copy {bag} to {folder}: {error.strerror or error}") from error


def suffixed(folder: Path, suffix: str) -> Iterator[Path]:
    """Yield folder + suffix, then folder + suffix.2 and so on."""
    for number in count(1):
        yield folder.with_name(folder.name + suffix + (f".{number}" if number > 1 else ""))
