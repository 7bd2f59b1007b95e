"""Demonstrations on disk: one bag, or a folder of bags NNN that show one task several times."""

from __future__ import annotations

import shutil
from pathlib import Path

from irlpilco_ros.experience.bag_files import mcap_files
from irlpilco_ros.experience.bag_reader import messages_digest, read_bag
from irlpilco_ros.experience.durable import sync_tree
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trials import numbered_bags


def demonstration_bags(path: Path) -> list[Path]:
    """Return the bags of the demonstrations, in order; discarded ones are left out.

    Args:
        path: A bag (its folder or its .mcap file), or a folder of bags NNN.

    Raises:
        BagError: there is neither a bag nor a folder of them.
    """
    several = [bag for _, bag in numbered_bags(path)]
    if not several:
        mcap_files(path)
    return several or [path]


def read_demonstrations(path: Path) -> tuple[Trajectory, ...]:
    """Return what was shown; arguments and errors as `demonstration_bags` and `read_bag`.

    Raises:
        BagError: a bag cannot be read, or holds no samples.
    """
    shown = []
    for bag in demonstration_bags(path):
        trajectory = read_bag(bag)
        if not trajectory.stamps.size:
            raise BagError(f"the demonstration {bag} holds no samples")
        shown.append(trajectory)
    return tuple(shown)


def copy_demonstrations(source: Path, copy: Path) -> None:
    """Copy the bags of the demonstrations to a folder that is whole as soon as it is there."""
    temporary = copy.with_name(f".{copy.name}.tmp")
    shutil.rmtree(temporary, ignore_errors=True)
    bags = demonstration_bags(source)
    if source.is_file():
        temporary.mkdir()
        shutil.copy2(source, temporary)
    elif bags == [source]:
        shutil.copytree(source, temporary)
    else:
        for bag in bags:
            shutil.copytree(bag, temporary / bag.name)
    sync_tree(temporary)
    temporary.rename(copy)


def same_demonstrations(first: Path, second: Path) -> bool:
    """Whether two bags, or two folders of them, hold the same messages."""
    bags, others = demonstration_bags(first), demonstration_bags(second)
    return list(map(messages_digest, bags)) == list(map(messages_digest, others))
