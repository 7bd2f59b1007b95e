"""`irlpilco recover`: a whole bag from one whose recorder was killed."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from irlpilco_ros.experience.bag_files import RECOVERED
from irlpilco_ros.experience.bag_reader import Recording, read_recording
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.errors import BagError


def recover(path: Path) -> Path:
    """Write every message before the tear into a new bag next to the torn one.

    The torn bag stays as it is. The new one is called NNN.recovered, or NNN.recovered.2 and so on
    if there is one already.

    Args:
        path: The torn bag's folder or its .mcap file.

    Returns:
        The new bag.

    Raises:
        BagError: there is no bag, it is whole, or no message of it is left.
    """
    torn = read_recording(path)
    if torn.whole:
        raise BagError(f"{path} is whole: {len(torn.messages)} messages; nothing to recover")
    if not torn.messages:
        raise BagError(f"{path} holds no whole message; nothing can be recovered from it")
    bag = path.parent if path.is_file() else path
    with _next_to(bag, torn) as writer:
        for message in torn.messages:
            writer.append(message)
    copied = read_recording(writer.path)
    if not copied.whole or copied.messages != torn.messages:
        raise BagError(f"{writer.path} does not read back as {path}; is the disk sound?")
    return writer.path


def _next_to(bag: Path, torn: Recording) -> DurableBagWriter:
    """Make the new bag beside the old one, under the first name that is free."""
    bag = bag.absolute()
    custom = {**torn.custom, "recovered_from": bag.name}
    suffixes = (RECOVERED if number == 1 else f"{RECOVERED}.{number}" for number in count(1))
    names = (bag.with_name(bag.name + suffix) for suffix in suffixes)
    return DurableBagWriter(next(name for name in names if not name.exists()), custom)
